//! Numbers in words: for tables.

/// A count with its thousands apart: 1,234,567.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A count with its noun: 1 frame, 2,000 frames, 2 switches.
pub fn counted(count: u64, noun: &str) -> String {
    let ending = match count {
        1 => "",
        _ if noun.ends_with("ch") => "es",
        _ => "s",
    };
    format!("{} {noun}{ending}", grouped(count))
}

/// A number with so many decimals, without the sign of a zero.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|byte| b"0.".contains(&byte)) => zero.to_owned(),
        _ => text,
    }
}

/// Bits per Gaussian.
pub fn bits_per_gaussian(bytes: u64, gaussians: u64) -> f64 {
    bytes as f64 * 8.0 / gaussians.max(1) as f64
}

/// `part` of `whole` in percent.
pub fn percent(part: u64, whole: u64) -> f64 {
    part as f64 * 100.0 / whole.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_has_no_sign() {
        let numbers = [-0.0, -0.0004, -0.0006, 1.5].map(|value| fixed(value, 3));
        assert_eq!(numbers, ["0.000", "0.000", "-0.001", "1.500"]);
    }

    #[test]
    fn one_is_no_plural() {
        assert_eq!([0, 1, 2000].map(|count| counted(count, "GOP")), ["0 GOPs", "1 GOP", "2,000 GOPs"]);
        assert_eq!([1, 2].map(|count| counted(count, "switch")), ["1 switch", "2 switches"]);
    }

    #[test]
    fn thousands_are_apart() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
    }
}
