//! The PLY header: format, elements and their properties.

use std::collections::BTreeSet;

use nom::branch::alt;
use nom::bytes::complete::{tag, take_while, take_while1};
use nom::character::complete::{line_ending, space0, space1, u64 as decimal};
use nom::combinator::{map, value};
use nom::sequence::{delimited, preceded, terminated};
use nom::{IResult, Parser};

use crate::error::SceneError;
use crate::limits::Budget;

/// Bytes of memory that a line of a header takes beside its name, at most.
const LINE: u64 = 192;

/// Bytes of a header, at most: comments of programs that keep their settings in them take some thousands.
pub(crate) const MOST_HEADER: usize = 1 << 20;

const NOT_PLY: &str = "check that this is a PLY file and that the transfer did not change its line ends";

/// What precedes the values.
#[derive(Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
    /// Bytes up to and with the line end after `end_header`.
    pub(crate) length: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Debug, PartialEq)]
pub(crate) struct Element {
    pub(crate) name: String,
    /// Rows, as the file says: not yet compared with anything.
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

#[derive(Debug, PartialEq)]
pub(crate) struct Property {
    pub(crate) name: String,
    pub(crate) kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

/// The eight scalar types, under either of their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

impl Header {
    pub(crate) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

impl Element {
    pub(crate) fn has(&self, name: &str) -> bool {
        self.properties.iter().any(|property| property.name == name)
    }
}

/// One line of a header, apart from the first.
enum Line {
    Format(Encoding),
    Remark,
    Element(Element),
    Property(Property),
    End,
}

/// Whether `bytes` begin as every PLY file does.
pub(crate) fn is_ply(bytes: &[u8]) -> bool {
    first_line(bytes).is_ok()
}

/// Reads the header at the start of `bytes`.
///
/// # Errors
/// The byte offset of the first line that is not understood, or that of the end where none is the last.
pub(crate) fn parse(bytes: &[u8], budget: &mut Budget) -> Result<Header, SceneError> {
    let (bytes, is_cut) = match bytes.get(..MOST_HEADER) {
        Some(first) if first.len() < bytes.len() => (first, true),
        _ => (bytes, false),
    };
    let refuse = |rest: &[u8], what: String| {
        SceneError::malformed(bytes.len().saturating_sub(rest.len()), what, NOT_PLY)
    };
    let (mut rest, ()) =
        first_line(bytes).map_err(|_| refuse(bytes, "the first line is not \"ply\"".into()))?;
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut names = BTreeSet::new();
    loop {
        budget.take(LINE, "a PLY header")?;
        let (after, line) =
            line(rest).map_err(|_| match rest.is_empty() || is_cut && !rest.contains(&b'\n') {
                true => endless(bytes.len(), is_cut),
                false => refuse(rest, format!("no PLY header line: \"{}\"", excerpt(rest))),
            })?;
        match line {
            Line::Format(found) => encoding = Some(found),
            Line::Remark => {}
            Line::Element(element) => {
                budget.take((element.name.len() as u64).saturating_mul(2), "a PLY header")?;
                unique(&mut names, None, &element.name).map_err(|what| refuse(rest, what))?;
                elements.push(element);
            }
            Line::Property(property) => {
                let number = elements.len();
                let owner = elements
                    .last_mut()
                    .ok_or_else(|| refuse(rest, "a property comes before any element".into()))?;
                budget.take((property.name.len() as u64).saturating_mul(2), "a PLY header")?;
                unique(&mut names, Some(number), &property.name).map_err(|what| refuse(rest, what))?;
                owner.properties.push(property);
            }
            Line::End => {
                let encoding = encoding.ok_or_else(|| refuse(rest, "the format line is missing".into()))?;
                return Ok(Header { encoding, elements, length: bytes.len().saturating_sub(after.len()) });
            }
        }
        rest = after;
    }
}

/// The error of a header whose last line is not among its first bytes, which are those of the file unless they are cut.
fn endless(length: usize, is_cut: bool) -> SceneError {
    match is_cut {
        true => SceneError::malformed(
            length,
            format!("the PLY header goes on after {MOST_HEADER} bytes, the most that is read"),
            "take comments or properties out of it",
        ),
        false => SceneError::malformed(
            length,
            "the file ends before the line \"end_header\" of its PLY header",
            "the file is cut short, copy it again",
        ),
    }
}

/// Refuses a name that comes twice among elements, or among the properties of the element with a number: which of the two is meant could not be told.
fn unique(
    names: &mut BTreeSet<(Option<usize>, String)>,
    owner: Option<usize>,
    name: &str,
) -> Result<(), String> {
    let new = names.insert((owner, name.to_owned()));
    if new { Ok(()) } else { Err(format!("the name {name} comes twice")) }
}

fn first_line(input: &[u8]) -> IResult<&[u8], ()> {
    value((), (tag("ply"), space0, line_ending)).parse(input)
}

fn line(input: &[u8]) -> IResult<&[u8], Line> {
    let content = alt((
        map(preceded((tag("format"), space1), encoding), Line::Format),
        map(preceded((tag("element"), space1), element), Line::Element),
        map(preceded((tag("property"), space1), property), Line::Property),
        map((alt((tag("comment"), tag("obj_info"))), take_while(|byte| byte != b'\n')), |_| Line::Remark),
        map(tag("end_header"), |_| Line::End),
        map(space0, |_| Line::Remark),
    ));
    // A remark has taken its carriage return with it; `line_ending` accepts either form.
    delimited(space0, content, (space0, line_ending)).parse(input)
}

fn encoding(input: &[u8]) -> IResult<&[u8], Encoding> {
    let name = alt((
        value(Encoding::Ascii, tag("ascii")),
        value(Encoding::LittleEndian, tag("binary_little_endian")),
        value(Encoding::BigEndian, tag("binary_big_endian")),
    ));
    terminated(name, (space1, tag("1.0"))).parse(input)
}

fn element(input: &[u8]) -> IResult<&[u8], Element> {
    let (rest, (name, _, count)) = (word, space1, decimal).parse(input)?;
    Ok((rest, Element { name, count, properties: Vec::new() }))
}

fn property(input: &[u8]) -> IResult<&[u8], Property> {
    let list = preceded((tag("list"), space1), (terminated(scalar, space1), scalar));
    let kind = alt((map(list, |(count, item)| Kind::List { count, item }), map(scalar, Kind::Scalar)));
    let (rest, (kind, _, name)) = (kind, space1, word).parse(input)?;
    Ok((rest, Property { name, kind }))
}

fn scalar(input: &[u8]) -> IResult<&[u8], Scalar> {
    let (rest, name) = take_while1(|byte: u8| byte.is_ascii_alphanumeric()).parse(input)?;
    let scalar = match name {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => {
            return Err(nom::Err::Error(nom::error::Error::new(input, nom::error::ErrorKind::Alt)));
        }
    };
    Ok((rest, scalar))
}

fn word(input: &[u8]) -> IResult<&[u8], String> {
    map(take_while1(|byte: u8| byte.is_ascii_graphic()), |name| String::from_utf8_lossy(name).into_owned())
        .parse(input)
}

/// The start of a line that was not understood, for people.
fn excerpt(line: &[u8]) -> String {
    let shown = line.iter().take(40).take_while(|&&byte| byte != b'\n');
    shown.flat_map(|&byte| std::ascii::escape_default(byte)).map(char::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::ReadLimits;

    fn budget() -> Budget {
        Budget::new(&ReadLimits::default())
    }

    #[test]
    fn a_header_is_read_up_to_its_last_line_end() {
        let text = b"ply\r\nformat ascii 1.0\r\ncomment \xff\r\nelement vertex 3\r\nproperty float x\r\n\
                     property list uchar int of\r\nend_header\r\n1 2 3";
        let header = parse(text, &mut budget()).unwrap();
        assert_eq!(header.length, text.len() - 5);
        assert_eq!(header.encoding, Encoding::Ascii);
        let vertex = header.element("vertex").unwrap();
        assert_eq!((vertex.count, vertex.properties.len()), (3, 2));
        assert_eq!(vertex.properties[1].kind, Kind::List { count: Scalar::U8, item: Scalar::I32 });
    }

    #[test]
    fn the_error_says_which_line() {
        let error = parse(b"ply\nformat ascii 1.0\nelement vertex many\n", &mut budget()).unwrap_err();
        assert!(
            error.to_string().starts_with("byte 21: no PLY header line: \"element vertex many\""),
            "{error}"
        );
    }

    #[test]
    fn a_header_without_end_is_told_from_one_that_is_too_long() {
        let read = |text: &str| parse(text.as_bytes(), &mut budget());
        let start = "ply\nformat ascii 1.0\n";
        let said = read(&format!("{start}element vertex 3\n")).unwrap_err().to_string();
        assert!(said.starts_with("byte 38: the file ends before the line \"end_header\""), "{said}");
        let of_length = |length: usize| {
            let comment = length - start.len() - "comment \nend_header\n".len();
            format!("{start}comment {}\nend_header\n1 2 3", "x".repeat(comment))
        };
        assert_eq!(read(&of_length(MOST_HEADER)).unwrap().length, MOST_HEADER);
        let said = read(&of_length(MOST_HEADER + 1)).unwrap_err().to_string();
        assert!(said.starts_with("byte 1048576: the PLY header goes on after 1048576 bytes"), "{said}");
        assert!(said.ends_with("take comments or properties out of it"), "{said}");
    }
}
