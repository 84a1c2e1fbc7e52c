//! Shaders that a test may spoil.

use std::fs;
use std::path::Path;

use marmor::frame::shaders::SOURCES;

/// A copy of them.
pub fn copy() -> tempfile::TempDir {
    let copy = tempfile::tempdir().expect("a folder");
    for (name, text) in SOURCES {
        fs::write(copy.path().join(name), text).expect("a copy");
    }
    copy
}

/// Writes `after` in place of `before` in `file` of `folder`.
pub fn replace(folder: &Path, file: &str, before: &str, after: &str) {
    let path = folder.join(file);
    let text = fs::read_to_string(&path).expect("a shader");
    assert!(text.contains(before), "{file} has no {before:?}");
    fs::write(&path, text.replace(before, after)).expect("a changed shader");
}
