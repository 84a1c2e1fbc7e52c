//! Files as bytes and text, with messages that name them.

use std::path::Path;

use super::Error;

/// Reads a regular file whole.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    let fault = |error: std::io::Error| {
        let problem = match error.kind() {
            std::io::ErrorKind::NotFound => "no such file; check the path".to_owned(),
            _ => format!("cannot be read ({error}); check the path and its permissions"),
        };
        Error::of(path.display(), problem)
    };
    // A device or a pipe might never end, so only regular files are read.
    if !std::fs::metadata(path).map_err(fault)?.is_file() {
        return Err(Error::of(
            path.display(),
            "not a regular file; name a .toml or .obj file",
        ));
    }
    std::fs::read(path).map_err(fault)
}

/// The bytes of a file as text, or the line of the first byte that is none.
pub(super) fn utf8<'a>(bytes: &'a [u8], name: &str) -> Result<&'a str, Error> {
    std::str::from_utf8(bytes).map_err(|fault| {
        let good = bytes.get(..fault.valid_up_to()).unwrap_or_default();
        let line = 1 + good.iter().filter(|&&b| b == b'\n').count();
        Error::at(name, line, "not UTF-8 text; save the file as UTF-8")
    })
}
