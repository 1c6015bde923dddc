//! Arrays as NumPy stores them.
//!
//! Source: NumPy's documentation, "numpy.lib.format", versions 1.0 and 2.0.

use nom::branch::alt;
use nom::bytes::complete::{tag, take_till};
use nom::character::complete::{char, multispace0, u64 as number};
use nom::combinator::{all_consuming, opt};
use nom::multi::{length_data, separated_list0};
use nom::number::complete::{le_u16, le_u32};
use nom::sequence::{delimited, preceded, separated_pair, terminated};
use nom::{IResult, Parser};

/// An array of 32-bit floats, the last axis fastest.
pub(super) struct Array {
    pub(super) shape: Vec<u64>,
    pub(super) values: Vec<f32>,
}

/// What the header says of one property.
enum Property<'a> {
    Type(&'a str),
    ColumnsFirst(bool),
    Shape(Vec<u64>),
}

/// Reads a file of little-endian 32-bit floats in the order of C; None if it is anything else, or if its values
/// are not as many as its shape says.
pub(super) fn read(file: &[u8]) -> Option<Array> {
    let (data, header) = header(file).ok()?;
    let (_, properties) = all_consuming(dictionary).parse(std::str::from_utf8(header).ok()?).ok()?;
    let mut shape = None;
    let mut floats = false;
    let mut rows_first = false;
    for property in properties {
        match property {
            Property::Type(name) => floats = name == "<f4",
            Property::ColumnsFirst(columns_first) => rows_first = !columns_first,
            Property::Shape(axes) => shape = Some(axes),
        }
    }
    let shape = shape.filter(|_| floats && rows_first)?;
    let count = shape.iter().try_fold(1_u64, |product, &axis| product.checked_mul(axis))?;
    let (values, rest) = data.as_chunks::<4>();
    let fits = rest.is_empty() && u64::try_from(values.len()) == Ok(count);
    fits.then(|| Array { shape, values: values.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect() })
}

/// The text before the data.
fn header(file: &[u8]) -> IResult<&[u8], &[u8]> {
    let version_1 = preceded(tag(&b"\x01\x00"[..]), length_data(le_u16));
    let version_2 = preceded(tag(&b"\x02\x00"[..]), length_data(le_u32));
    preceded(tag(&b"\x93NUMPY"[..]), alt((version_1, version_2))).parse(file)
}

/// A literal of Python with the properties in any order.
fn dictionary(text: &str) -> IResult<&str, Vec<Property<'_>>> {
    let properties = terminated(separated_list0(comma, property), opt(comma));
    delimited((char('{'), multispace0), properties, (multispace0, char('}'), multispace0)).parse(text)
}

fn property(text: &str) -> IResult<&str, Property<'_>> {
    let truth = alt((tag("True").map(|_| true), tag("False").map(|_| false)));
    alt((
        named("'descr'", quoted).map(Property::Type),
        named("'fortran_order'", truth).map(Property::ColumnsFirst),
        named("'shape'", tuple).map(Property::Shape),
    ))
    .parse(text)
}

fn named<'a, V>(
    name: &'static str,
    value: impl Parser<&'a str, Output = V, Error = nom::error::Error<&'a str>>,
) -> impl Parser<&'a str, Output = V, Error = nom::error::Error<&'a str>> {
    separated_pair(tag(name), (multispace0, char(':'), multispace0), value).map(|(_, value)| value)
}

fn quoted(text: &str) -> IResult<&str, &str> {
    delimited(char('\''), take_till(|c| c == '\''), char('\'')).parse(text)
}

fn tuple(text: &str) -> IResult<&str, Vec<u64>> {
    let axes = terminated(separated_list0(comma, number), opt(comma));
    delimited(char('('), axes, char(')')).parse(text)
}

fn comma(text: &str) -> IResult<&str, char> {
    delimited(multispace0, char(','), multispace0).parse(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, values: &[f32]) -> Vec<u8> {
        let length = (header.len() as u32).to_le_bytes();
        let length = if version == 1 { &length[..2] } else { &length[..] };
        let values = values.iter().flat_map(|value| value.to_le_bytes());
        [b"\x93NUMPY", &[version, 0][..], length, header.as_bytes()]
            .concat()
            .into_iter()
            .chain(values)
            .collect()
    }

    #[test]
    fn both_versions_and_all_shapes_are_read() {
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1), }   \n";
        for version in [1, 2] {
            let array = read(&file(version, header, &[1.5, -2.0])).unwrap();
            assert_eq!((array.shape, array.values), (vec![2, 1], vec![1.5, -2.0]));
        }
        let header = "{'shape': (3,), 'fortran_order': False, 'descr': '<f4'}";
        assert_eq!(read(&file(1, header, &[0.0; 3])).unwrap().shape, [3]);
        assert!(read(&file(1, "{'shape': (), 'fortran_order': False, 'descr': '<f4'}", &[0.0])).is_some());
    }

    #[test]
    fn other_arrays_are_refused() {
        for header in [
            "{'descr': '<f8', 'fortran_order': False, 'shape': (2,)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (2,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (3,)}",
            "{'descr': '<f4', 'fortran_order': False}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2,)} more",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (4294967296, 4294967296)}",
        ] {
            assert!(read(&file(1, header, &[0.0; 2])).is_none(), "{header}");
        }
        assert!(read(b"\x93NUMPY\x01\x00\xff\xff").is_none());
    }
}
