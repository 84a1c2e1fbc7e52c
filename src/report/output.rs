//! Files that are written whole or not at all.

use super::Error;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file that can be written: its folder exists and takes new files.
///
/// Made before the work whose result it will hold, so that a bad path costs nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    path: PathBuf,
}

impl Output {
    /// Checks that `path` can be written. Leaves nothing behind.
    ///
    /// # Errors
    /// The path is a folder or another thing that is no file, its folder is missing, or
    /// no file can be made there.
    pub fn check(path: &Path) -> Result<Output, Error> {
        let fault = |problem: String| Error::of(path.display(), problem);
        if path.file_name().is_none() {
            return Err(fault("no file name; name a file to write".to_owned()));
        }
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => {
                return Err(fault("is a folder; name a file in it to write".to_owned()));
            }
            Ok(found) if !found.is_file() => {
                return Err(fault(
                    "is not a regular file; name another file to write".to_owned(),
                ));
            }
            _ => {}
        }
        let output = Output {
            path: path.to_owned(),
        };
        let folder = output.folder();
        if !folder.is_dir() {
            return Err(fault(format!(
                "there is no folder \"{}\"; create it first",
                folder.display()
            )));
        }
        // The only sure test of a folder is to make a file in it.
        output.temporary().map_err(|error| {
            fault(format!(
                "cannot write to the folder \"{}\" ({error}); choose another",
                folder.display()
            ))
        })?;
        Ok(output)
    }

    /// Whether both name the same file, however they are spelt.
    pub fn is(&self, other: &Output) -> bool {
        let place = |output: &Output| {
            let whole = fs::canonicalize(&output.path).ok();
            let folder = fs::canonicalize(output.folder()).ok();
            whole.or_else(|| Some(folder?.join(output.path.file_name()?)))
        };
        place(self).is_some_and(|path| Some(path) == place(other))
    }

    /// The file's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file through a temporary one in the same folder, which takes the file's
    /// place when `write` has succeeded and vanishes when it has not.
    ///
    /// # Errors
    /// What `write` reports, or a full or vanished disk.
    pub fn write<E: std::fmt::Display>(
        &self,
        write: impl FnOnce(&mut BufWriter<&mut fs::File>) -> Result<(), E>,
    ) -> Result<(), Error> {
        let fault = |problem: String| Error::of(self.path.display(), problem);
        let io = |error: io::Error| {
            fault(format!(
                "cannot be written ({error}); check the disk and its permissions"
            ))
        };
        let mut temporary = self.temporary().map_err(io)?;
        let mut buffered = BufWriter::new(temporary.as_file_mut());
        write(&mut buffered).map_err(|error| fault(format!("cannot be written ({error})")))?;
        buffered.flush().map_err(io)?;
        drop(buffered);
        temporary
            .persist(&self.path)
            .map_err(|error| io(error.error))?;
        Ok(())
    }

    fn folder(&self) -> &Path {
        match self.path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }

    fn temporary(&self) -> io::Result<NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".marmor-");
        // Temporary files are private by default; a picture has the usual permissions.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        builder.tempfile_in(self.folder())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        let output = Output::check(&path).expect("writable");
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0);
        output
            .write(|w| w.write_all(b"first"))
            .expect("a first write");
        output
            .write(|w| {
                w.write_all(b"second")?;
                Err(io::Error::other("interrupted"))
            })
            .expect_err("a failed write");
        assert_eq!(fs::read(&path).expect("a file"), b"first");
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 1);
    }
}
