//! Ranges and conditions of requests (RFC 9110, clauses 13 and 14).

use hyper::header::{
    HeaderMap, HeaderName, IF_MATCH, IF_MODIFIED_SINCE, IF_NONE_MATCH, IF_RANGE, IF_UNMODIFIED_SINCE, RANGE,
};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// What tells one version of a file from another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Version {
    /// With its quotation marks.
    pub(super) etag: String,
    /// To the second, as headers have it.
    pub(super) modified: SystemTime,
}

impl Version {
    /// Of a file's length and time of modification.
    ///
    /// The entity tag is strong and needs no reading of the file, which may have gigabytes: packages are written beside
    /// and renamed, so other bytes have another time to the nanosecond. It is the same on every server that has a copy of
    /// the folder with its times.
    pub(super) fn new(length: u64, modified: SystemTime) -> Self {
        let since = modified.duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            etag: format!("\"{length:x}-{:x}\"", since.as_nanos()),
            modified: UNIX_EPOCH.checked_add(Duration::from_secs(since.as_secs())).unwrap_or(UNIX_EPOCH),
        }
    }

    /// Whether a list of entity tags has this one; `*` is any. Weak ones count where that is asked for.
    fn is_in(&self, list: &str, weak_counts: bool) -> bool {
        list.split(',').map(str::trim).any(|tag| match tag.strip_prefix("W/") {
            Some(weak) => weak_counts && weak == self.etag,
            None => tag == "*" || tag == self.etag,
        })
    }
}

/// How a request for a file is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Answer {
    /// 200
    Whole,
    /// 206: the first byte, and how many there are, 1 or more.
    Part { first: u64, length: u64 },
    /// 304
    NotModified,
    /// 412
    PreconditionFailed,
    /// 416
    Unsatisfiable,
}

impl Answer {
    /// What a request's headers ask of a file of so many bytes.
    pub(super) fn to(headers: &HeaderMap, version: &Version, length: u64) -> Self {
        if let Some(stop) = precondition(headers, version) {
            return stop;
        }
        match text(headers, &RANGE) {
            Some(range) if range_applies(headers, version) => part(range, length),
            _ => Self::Whole,
        }
    }
}

/// RFC 9110, clause 13.2.2, steps 1 to 4.
fn precondition(headers: &HeaderMap, version: &Version) -> Option<Answer> {
    let fails = match text(headers, &IF_MATCH) {
        Some(list) => !version.is_in(list, false),
        None => date(headers, &IF_UNMODIFIED_SINCE).is_some_and(|date| version.modified > date),
    };
    if fails {
        return Some(Answer::PreconditionFailed);
    }
    let is_known = match text(headers, &IF_NONE_MATCH) {
        Some(list) => version.is_in(list, true),
        None => date(headers, &IF_MODIFIED_SINCE).is_some_and(|date| version.modified <= date),
    };
    is_known.then_some(Answer::NotModified)
}

/// RFC 9110, clause 13.1.5: the range counts only if the client has a part of this very version.
fn range_applies(headers: &HeaderMap, version: &Version) -> bool {
    let Some(validator) = headers.get(IF_RANGE) else { return true };
    let Ok(validator) = validator.to_str() else { return false };
    match httpdate::parse_http_date(validator) {
        Ok(date) => date == version.modified,
        Err(_) => validator.trim() == version.etag,
    }
}

/// RFC 9110, clause 14.1.2. Several ranges, other units and what is no range are ignored, as the clause allows: the answer
/// is the whole file.
fn part(range: &str, length: u64) -> Answer {
    let of_bytes = range.split_once('=').filter(|(unit, _)| unit.trim().eq_ignore_ascii_case("bytes"));
    let Some((first, last)) = of_bytes.and_then(|(_, range)| range.trim().split_once('-')) else {
        return Answer::Whole;
    };
    let (first, length) = match (number(first), number(last)) {
        // The last bytes.
        (_, Some(suffix)) if first.is_empty() => (length.saturating_sub(suffix), length.min(suffix)),
        (Some(first), _) if last.is_empty() => (first, length.saturating_sub(first)),
        (Some(first), Some(last)) if first <= last => {
            (first, last.saturating_add(1).min(length).saturating_sub(first))
        }
        _ => return Answer::Whole,
    };
    match length {
        0 => Answer::Unsatisfiable,
        length => Answer::Part { first, length },
    }
}

/// Digits only; more than fit are the largest number.
fn number(digits: &str) -> Option<u64> {
    let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then(|| digits.parse().unwrap_or(u64::MAX))
}

fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    headers.get(name)?.to_str().ok()
}

fn date(headers: &HeaderMap, name: &HeaderName) -> Option<SystemTime> {
    httpdate::parse_http_date(text(headers, name)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PART: fn(u64, u64) -> Answer = |first, length| Answer::Part { first, length };

    #[test]
    fn ranges_are_what_the_standard_says() {
        let cases = [
            ("bytes=0-99", PART(0, 100)),
            ("bytes=900-2000", PART(900, 100)),
            ("bytes=990-", PART(990, 10)),
            ("bytes=-10", PART(990, 10)),
            ("bytes=-2000", PART(0, 1000)),
            ("Bytes = 0-0", PART(0, 1)),
            ("bytes=0-99999999999999999999999", PART(0, 1000)),
            ("bytes=1000-", Answer::Unsatisfiable),
            ("bytes=5000-6000", Answer::Unsatisfiable),
            ("bytes=-0", Answer::Unsatisfiable),
            ("bytes=9-8", Answer::Whole),
            ("bytes=0-1,5-6", Answer::Whole),
            ("bytes=-", Answer::Whole),
            ("bytes=+1-2", Answer::Whole),
            ("bytes", Answer::Whole),
            ("items=0-1", Answer::Whole),
        ];
        for (range, answer) in cases {
            assert_eq!(part(range, 1000), answer, "{range}");
        }
        assert_eq!(part("bytes=0-", 0), Answer::Unsatisfiable);
    }

    #[test]
    fn conditions_come_in_the_order_of_the_standard() {
        let version = Version::new(1000, UNIX_EPOCH + Duration::new(1_000_000_000, 5));
        let before = "Sun, 09 Sep 2001 01:46:39 GMT";
        let then = "Sun, 09 Sep 2001 01:46:40 GMT";
        let cases: [(&[(HeaderName, &str)], Answer); 12] = [
            (&[(IF_NONE_MATCH, "\"3e8-de0b6b3a7640005\"")], Answer::NotModified),
            (&[(IF_NONE_MATCH, "\"a\", W/\"3e8-de0b6b3a7640005\"")], Answer::NotModified),
            (&[(IF_NONE_MATCH, "\"a\""), (IF_MODIFIED_SINCE, then)], Answer::Whole),
            (&[(IF_MODIFIED_SINCE, then)], Answer::NotModified),
            (&[(IF_MODIFIED_SINCE, before)], Answer::Whole),
            (&[(IF_MATCH, "\"a\"")], Answer::PreconditionFailed),
            (&[(IF_MATCH, "*"), (IF_UNMODIFIED_SINCE, before)], Answer::Whole),
            (&[(IF_UNMODIFIED_SINCE, before)], Answer::PreconditionFailed),
            (&[(RANGE, "bytes=0-9"), (IF_RANGE, "\"3e8-de0b6b3a7640005\"")], PART(0, 10)),
            (&[(RANGE, "bytes=0-9"), (IF_RANGE, "W/\"3e8-de0b6b3a7640005\"")], Answer::Whole),
            (&[(RANGE, "bytes=0-9"), (IF_RANGE, then)], PART(0, 10)),
            (&[(RANGE, "bytes=0-9"), (IF_RANGE, before)], Answer::Whole),
        ];
        for (given, answer) in cases {
            let pairs = given.iter().map(|(name, value)| (name.clone(), value.parse().expect("a value")));
            assert_eq!(Answer::to(&pairs.collect(), &version, 1000), answer, "{given:?}");
        }
    }

    proptest! {
        #[test]
        fn a_part_lies_in_the_file(range in "(bytes=)?[0-9]{0,20}-?[0-9]{0,20}(,[0-9]-[0-9])?", length: u64) {
            if let Answer::Part { first, length: part } = part(&range, length) {
                prop_assert!(part > 0 && first.checked_add(part).is_some_and(|end| end <= length));
            }
        }
    }
}
