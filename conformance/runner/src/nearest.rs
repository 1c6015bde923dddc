//! Names that somebody may have meant.

/// How many are suggested.
const SUGGESTED: usize = 3;

/// The names most like a word: those that hold it first, then those with the fewest letters to change.
pub fn nearest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let mut names: Vec<&str> = names.into_iter().collect();
    names.sort_unstable();
    names.dedup();
    names.sort_by_cached_key(|name| {
        let holds = !word.is_empty() && (name.contains(word) || word.contains(name));
        (!holds, distance(word, name))
    });
    names.truncate(SUGGESTED);
    names
}

/// Letters to put in, take out or exchange on the way from one word to another.
fn distance(from: &str, to: &str) -> usize {
    let mut row: Vec<usize> = (0..=to.chars().count()).collect();
    for (place, a) in from.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], place + 1);
        for (column, b) in (1..).zip(to.chars()) {
            let exchanged = diagonal + usize::from(a != b);
            diagonal = row[column];
            row[column] = exchanged.min(row[column] + 1).min(row[column - 1] + 1);
        }
    }
    row[to.chars().count()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_suggested_is_like_the_word() {
        let names = ["b-frames", "prefixes", "sh", "cells", "vq"];
        assert_eq!(nearest("bframes", names)[0], "b-frames");
        assert_eq!(nearest("prefix", names)[0], "prefixes");
        assert_eq!(nearest("cell-field", names)[0], "cells");
        assert_eq!((distance("kitten", "sitting"), distance("", "ab"), distance("ab", "ab")), (3, 2, 0));
    }
}
