//! What to do about a stream that asks for more than a limit: raise it where an option does, or no option can help.

use splatstream_format::{Error, ErrorKind, Limits};

/// The option that raises limits.
const OPTION: &str = "--max-gaussians";

/// The option that says how much memory decoding or encoding may take.
const MEMORY: &str = "--max-memory";

/// The advice for an error of this class in a stream of a level, if that is known.
pub(crate) fn advice(error: &Error, level: Option<u8>) -> String {
    let ErrorKind::OverLimit { limit, asked, allowed } = error.kind else { return String::new() };
    // A level that is not known may be the highest.
    let highest = *Limits::LEVELS.end();
    let of_level = Limits::of_level(level.unwrap_or(highest));
    // Above the Gaussians of its default the option stands for the other limits of the highest level too.
    let (most, enough) = match limit {
        "max_gaussians" => (u64::from(of_level.max_gaussians), asked),
        "max_gaussian_rate" => (of_level.max_gaussian_rate, of_level.max_gaussians.into()),
        "max_learned" => (of_level.max_learned.into(), of_level.max_gaussians.into()),
        "memory in bytes" => {
            return format!(
                "decoding it may take more memory than this machine has free: close other programs, decode a lower operating \
                 point, or allow it with {MEMORY} {}",
                megabytes(asked)
            );
        }
        "memory of this machine" => {
            return "decoding it takes more memory than there is: close other programs, or take a machine with more"
                .to_owned();
        }
        _ => (0, 0),
    };
    if allowed < most && asked <= most {
        return format!("if you trust the file, raise the limit with {OPTION} {enough}");
    }
    let whose = match level {
        Some(level) => {
            format!("that of level {level} of the specification, which the stream says it keeps to")
        }
        None => "one of the specification".to_owned(),
    };
    format!("no option raises this limit: it is {whose}; report it to the author of the encoder")
}

/// The advice where encoding takes so many bytes and may not.
pub(crate) fn of_encoding(asked: u64) -> String {
    format!(
        "close other programs, or {} where there is as much; a faster --preset and no --finetune take less, and \
         of a sequence --all-intra, a smaller --gop, and a --shard instead of a --target-mb",
        allow(asked)
    )
}

/// How so many bytes are allowed.
pub(crate) fn allow(bytes: u64) -> String {
    format!("allow it with {MEMORY} {}", megabytes(bytes))
}

/// A size as the option reads it, rounded up.
fn megabytes(bytes: u64) -> String {
    format!("{}M", bytes.div_ceil(1 << 20))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(limit: &'static str, asked: u64, allowed: u64, level: Option<u8>) -> String {
        advice(&Error::new(0, "A.2", ErrorKind::OverLimit { limit, asked, allowed }), level)
    }

    #[test]
    fn an_option_is_named_where_it_helps_and_nowhere_else() {
        let helps = |text: &str| text.contains(OPTION);
        assert!(of("max_gaussians", 100, 10, Some(1)).ends_with("--max-gaussians 100"));
        assert!(of("max_gaussians", 5 << 20, 4 << 20, Some(4)).ends_with("--max-gaussians 5242880"));
        assert!(of("max_gaussians", 100, 10, None).ends_with("--max-gaussians 100"));
        // Up to the level, and no further.
        assert!(!helps(&of("max_gaussians", (1 << 18) + 1, 1 << 18, Some(1))));
        assert!(!helps(&of("max_gaussians", u32::MAX.into(), 4 << 20, Some(4))));
        assert!(of("memory in bytes", (7 << 30) + 1, 1 << 30, Some(4)).ends_with("--max-memory 7169M"));
        // The limits that go with it.
        for (limit, asked, allowed) in
            [("max_gaussian_rate", 1 << 29, 1 << 28), ("max_learned", 3 << 20, 2 << 20)]
        {
            assert!(of(limit, asked, allowed, Some(4)).ends_with("--max-gaussians 16777216"), "{limit}");
            assert!(!helps(&of(limit, asked, allowed, Some(3))), "{limit}");
        }
        for limit in
            ["max_payload", "max_units", "max_codebook_values", "max_cells", "memory of this machine"]
        {
            assert!(!helps(&of(limit, 2, 1, Some(4))) && !helps(&of(limit, 2, 1, None)), "{limit}");
        }
    }
}
