//! Suggestions for a misspelt name.

/// How many names are suggested.
const SUGGESTED: usize = 3;

/// The names most similar to a word: first those that contain it or are contained in it, then those with the smallest
/// edit distance.
pub fn closest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let mut names: Vec<&str> = names.into_iter().collect();
    names.sort_unstable();
    names.dedup();
    names.sort_by_cached_key(|name| {
        let overlaps = !word.is_empty() && (name.contains(word) || word.contains(name));
        (!overlaps, strsim::levenshtein(word, name))
    });
    names.truncate(SUGGESTED);
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions_are_similar_to_the_word() {
        let names = ["b-frames", "prefixes", "sh", "cells", "vq"];
        assert_eq!(closest("bframes", names)[0], "b-frames");
        assert_eq!(closest("prefix", names)[0], "prefixes");
        assert_eq!(closest("cell-field", names)[0], "cells");
    }
}
