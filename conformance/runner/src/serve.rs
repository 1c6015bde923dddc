//! The decoder's side of `--stdio`: answers requests line by line.

use crate::protocol::{Diagnosis, Request};
use std::io::{self, BufRead, ErrorKind, Write};

/// Answers every line of `requests` until they end, or until a line that is not a request or cannot be answered.
///
/// # Errors
/// Those of `answer`; [`ErrorKind::InvalidData`] for a line that is not a request.
pub fn serve(
    requests: impl BufRead,
    mut answers: impl Write,
    mut answer: impl FnMut(&Request) -> io::Result<(i32, Option<Diagnosis>)>,
) -> io::Result<()> {
    for line in requests.lines() {
        let line = line?;
        let request = Request::parse(&line).ok_or_else(|| {
            let message = format!("'{line}' is not a request; a request is `in TAB op TAB mode TAB out`");
            io::Error::new(ErrorKind::InvalidData, message)
        })?;
        let (code, diagnosis) = answer(&request)?;
        match diagnosis {
            None => writeln!(answers, "{code}")?,
            Some(diagnosis) => writeln!(answers, "{code}\t{}", serde_json::to_string(&diagnosis)?)?,
        }
        answers.flush()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_request_gets_one_line() {
        let mut answers = Vec::new();
        let answer = |request: &Request| {
            let diagnosis = Diagnosis { byte: Some(3), ..Diagnosis::default() };
            Ok(if request.op == "s0,t0,r0" { (0, None) } else { (11, Some(diagnosis)) })
        };
        let requests = "a\ts0,t0,r0\tfull\tout\na\ts1,t0,r0\tfull\tout\n";
        serve(requests.as_bytes(), &mut answers, answer).unwrap();
        assert_eq!(String::from_utf8(answers).unwrap(), "0\n11\t{\"byte\":3}\n");
        assert!(serve("nonsense\n".as_bytes(), Vec::new(), |_| Ok((0, None))).is_err());
    }
}
