//! Text of files as messages show it.

use std::fmt::{self, Write};

/// Text whose characters of control stand as their escapes.
///
/// Names come from inside files that anybody may have written, and messages end in terminals, which obey some characters:
/// they clear the screen, name the window, or turn what follows around. Anything else stays as it is, in any script.
pub(crate) struct Printable<'a>(pub(crate) &'a str);

impl fmt::Display for Printable<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|c| match is_obeyed(c) {
            true => write!(f, "{}", c.escape_default()),
            false => f.write_char(c),
        })
    }
}

/// Whether a character steers what shows it: controls, separators of lines, and what changes the direction of text.
fn is_obeyed(c: char) -> bool {
    let is_separator = matches!(c, '\u{2028}' | '\u{2029}');
    let turns =
        matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() || is_separator || turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_a_terminal_is_escaped_and_nothing_else() {
        let plain = "C:\\talk\\\"a'b\" \u{e9}e\u{301}\u{8a71}.ply";
        assert_eq!(Printable(plain).to_string(), plain);
        let said = Printable("a\u{1b}[2J\u{9b}1m\n\u{202e}b\u{7f}").to_string();
        assert_eq!(said, "a\\u{1b}[2J\\u{9b}1m\\n\\u{202e}b\\u{7f}");
    }
}
