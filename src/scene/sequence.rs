//! File names with a number in them, such as `walk_%04d.obj`, and meshes in a sequence of such files.

use super::{Error, Mesh, obj};
use std::path::{Path, PathBuf};

/// A path whose file name holds one number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    folder: PathBuf,
    /// As it was written, for messages.
    written: PathBuf,
    before: String,
    /// Digits at least, filled up with zeros.
    width: usize,
    after: String,
}

impl Pattern {
    /// The pattern that `path` is: `%d`, or `%04d` for four digits at least, once in its file name; `%%` is a percent sign.
    /// None where it has no such place.
    ///
    /// # Errors
    /// A phrase, where a percent sign stands for nothing, or there are two numbers.
    pub fn of(path: &Path) -> Result<Option<Pattern>, String> {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
            return Ok(None);
        };
        let mut text = String::new();
        let mut found: Option<(String, usize)> = None;
        let mut rest = name;
        while let Some(at) = rest.find('%') {
            text.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            if let Some(more) = rest.strip_prefix('%') {
                text.push('%');
                rest = more;
                continue;
            }
            let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
            let (width, more) = rest.split_at(digits);
            let wrong = || {
                format!(
                    "\"{name}\" has a percent sign that is no number; write one %04d, and %% for a percent sign"
                )
            };
            let more = more.strip_prefix('d').ok_or_else(wrong)?;
            let width: usize = match width {
                "" => 1,
                _ => width.parse().ok().filter(|w| *w <= 20).ok_or_else(wrong)?,
            };
            if found.replace((std::mem::take(&mut text), width)).is_some() {
                return Err(wrong());
            }
            rest = more;
        }
        text.push_str(rest);
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(found.map(|(before, width)| Pattern {
            folder,
            written: path.to_owned(),
            before,
            width: width.max(1),
            after: text,
        }))
    }

    /// The path of `number`.
    pub fn path(&self, number: u32) -> PathBuf {
        let Pattern {
            folder,
            before,
            width,
            after,
            ..
        } = self;
        folder.join(format!("{before}{number:0width$}{after}"))
    }

    /// The number in `name`, if it is one of the pattern's.
    fn number(&self, name: &str) -> Option<u32> {
        let digits = name
            .strip_prefix(self.before.as_str())?
            .strip_suffix(self.after.as_str())?;
        let padded =
            digits.len() == self.width || digits.len() > self.width && !digits.starts_with('0');
        let all = digits.bytes().all(|b| b.is_ascii_digit());
        (padded && all).then(|| digits.parse().ok())?
    }

    /// The numbers of the files that are there, ascending.
    ///
    /// # Errors
    /// The folder cannot be read, no file is there, or one is missing between others.
    fn numbers(&self, name: &str) -> Result<Vec<u32>, Error> {
        let folder = match self.folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => &self.folder,
        };
        let entries = std::fs::read_dir(folder).map_err(|error| {
            Error::of(
                name,
                format!("its folder cannot be read ({error}); check the path"),
            )
        })?;
        let mut numbers: Vec<u32> = entries
            .filter_map(|entry| self.number(entry.ok()?.file_name().to_str()?))
            .collect();
        numbers.sort_unstable();
        let Some(&first) = numbers.first() else {
            return Err(Error::of(
                name,
                "no file of this name, whatever its number (up to 4294967295); check the path",
            ));
        };
        match numbers
            .iter()
            .zip(first..)
            .find(|(found, expected)| **found != *expected)
        {
            Some((_, missing)) => Err(Error::of(
                self.path(missing).display(),
                "no such file, where others of the sequence follow; export it anew, or rename them",
            )),
            None => Ok(numbers),
        }
    }

    /// The meshes of the sequence, in the files' own unit.
    ///
    /// # Errors
    /// As [`obj::load`], and where a file is missing between others.
    pub fn load(&self) -> Result<Vec<Mesh>, Error> {
        let numbers = self.numbers(&self.written.display().to_string())?;
        numbers.iter().map(|&n| obj::load(&self.path(n))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(path: &str) -> Option<Pattern> {
        Pattern::of(Path::new(path)).expect("a good pattern")
    }

    #[test]
    fn patterns_have_one_number() {
        assert_eq!(pattern("a/walk.obj"), None);
        assert_eq!(pattern("a/100%%.obj"), None);
        let walk = pattern("a/walk_%04d.obj").expect("a pattern");
        assert_eq!(walk.path(7), Path::new("a/walk_0007.obj"));
        assert_eq!(walk.path(12345), Path::new("a/walk_12345.obj"));
        let plain = pattern("100%%_%d.png").expect("a pattern");
        assert_eq!(plain.path(12), Path::new("100%_12.png"));
        for wrong in ["a%.obj", "a%04x.obj", "%d_%d.obj", "%99999999999999999999d"] {
            let fault = Pattern::of(Path::new(wrong)).expect_err(wrong);
            assert!(fault.contains("%04d"), "{fault}");
        }
    }

    #[test]
    fn numbers_are_read_back() {
        let walk = pattern("walk_%04d.obj").expect("a pattern");
        for number in [0, 7, 9999, 10000] {
            let path = walk.path(number);
            let name = path.to_str().expect("a name");
            assert_eq!(walk.number(name), Some(number), "{name}");
        }
        for other in [
            "walk_7.obj",
            "walk_00007.obj",
            "walk_0007.mtl",
            "walk_+007.obj",
            "run_0007.obj",
        ] {
            assert_eq!(walk.number(other), None, "{other}");
        }
    }

    #[test]
    fn a_sequence_has_no_gap() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s%02d.obj");
        let sequence = Pattern::of(&path).expect("good").expect("a pattern");
        assert!(
            sequence
                .load()
                .is_err_and(|e| e.to_string().contains("no file of this name"))
        );
        let triangle = |x: f64| format!("v 0 0 0\nv {x} 0 0\nv 0 1 0\nf 1 2 3\n");
        for n in [3, 4, 6] {
            std::fs::write(sequence.path(n), triangle(f64::from(n))).expect("written");
        }
        let fault = sequence.load().expect_err("a gap").to_string();
        assert!(
            fault.contains("s05.obj") && fault.lines().count() == 1,
            "{fault}"
        );
        std::fs::write(sequence.path(5), triangle(5.0)).expect("written");
        let meshes = sequence.load().expect("whole");
        let widths: Vec<f64> = meshes.iter().map(|m| m.positions[1].x).collect();
        assert_eq!(widths, [3.0, 4.0, 5.0, 6.0]);
    }
}
