//! Names that people type: the nearest known one when a name is unknown.

/// Likeness below which a suggestion would be a guess rather than a help.
const LIKENESS: f64 = 0.7;

/// The candidate most like `word`, if any is like it at all.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    candidates
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(&word, candidate), candidate))
        .filter(|(likeness, _)| *likeness >= LIKENESS)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// The remedy for an unknown name: the nearest known one, else the list of all.
///
/// Reads on from a statement such as `unknown material "marbel"`.
pub fn remedy(word: &str, candidates: &[&str]) -> String {
    match nearest(word, candidates.iter().copied()) {
        Some(candidate) => format!("did you mean \"{candidate}\"?"),
        None => format!("choose one of {}", candidates.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_suggested_and_far_ones_are_not() {
        assert_eq!(nearest("azimut", ["azimuth", "elevation"]), Some("azimuth"));
        assert_eq!(nearest("Marbel", ["marble", "ketchup"]), Some("marble"));
        assert_eq!(nearest("xyzzy", ["marble", "ketchup"]), None);
        assert_eq!(remedy("xyzzy", &["a", "b"]), "choose one of a, b");
    }
}
