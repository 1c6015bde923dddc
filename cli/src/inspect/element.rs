//! Elements as `--json` has them: numbers as numbers, names beside them; what the specification says of each element once.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use splatstream_format::inspect::{BLOCK_PARTS, Element, Number, Value};
use splatstream_format::payload::VARIABLE_ROWS;
use splatstream_format::syntax::TABLES;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// What the elements of the syntax tables mean, by record and element.
#[derive(Serialize)]
#[serde(transparent)]
pub(super) struct Records(BTreeMap<&'static str, BTreeMap<&'static str, &'static str>>);

/// The elements of a unit by record.
pub(super) struct Groups<'a>(pub(super) &'a [Element], pub(super) &'a Records);

/// Elements of a record, one after the other without gaps.
struct Group<'a>(&'a [Element], &'a Records);

/// An element of a group. Its meaning is there if it is not that of a table.
struct Member<'a>(&'a Element, &'a Records);

/// An element by itself, and the bytes that it touches.
pub(super) struct Alone<'a> {
    pub(super) element: &'a Element,
    pub(super) hex: &'a str,
}

/// A record of which every element is one number: names and values.
pub(super) struct Fields<'a>(pub(super) &'a [Element]);

/// The value of an element: a number, a string, an array; null where it is too long, or no value.
struct ValueJson<'a>(&'a Value);

struct NumberJson(Number);

impl Records {
    pub(super) fn new() -> Self {
        let mut records: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
        let fixed =
            TABLES.iter().flat_map(|table| table.rows.iter().map(|row| (table.name, row.name, row.meaning)));
        let variable = VARIABLE_ROWS.iter().map(|row| (row.record, row.name, row.meaning));
        let block = BLOCK_PARTS.into_iter().map(|(name, meaning)| ("block", name, meaning));
        for (record, name, meaning) in fixed.chain(variable).chain(block) {
            records.entry(record).or_default().insert(name, meaning);
        }
        Self(records)
    }

    /// Whether an element means what the tables say.
    fn explain(&self, element: &Element) -> bool {
        let name = element.name.rsplit('.').next().unwrap_or_default().split('[').next().unwrap_or_default();
        let meaning = self.0.get(element.record).and_then(|elements| elements.get(name));
        meaning.is_some_and(|meaning| *meaning == element.meaning)
    }
}

/// Whether an element goes on with the record of the one before it.
fn goes_on(before: &Element, element: &Element) -> bool {
    let is_same_plane = match (&before.meaning, &element.meaning) {
        (Cow::Owned(before), Cow::Owned(plane)) => before == plane,
        (Cow::Borrowed(_), Cow::Borrowed(_)) => true,
        _ => false,
    };
    before.record == element.record
        && before.clause == element.clause
        && before.at_bit + before.bits == element.at_bit
        && is_same_plane
}

impl Serialize for Groups<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let groups = self.0.chunk_by(goes_on).filter(|group| group.iter().any(|element| element.bits > 0));
        serializer.collect_seq(groups.map(|group| Group(group, self.1)))
    }
}

impl Serialize for Group<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(elements, records) = *self;
        let mut map = serializer.serialize_map(None)?;
        if let Some(Element { record, clause, at_bit, meaning, .. }) = elements.first() {
            map.serialize_entry("record", record)?;
            if let Cow::Owned(plane) = meaning {
                map.serialize_entry("plane", plane)?;
            }
            map.serialize_entry("clause", clause)?;
            map.serialize_entry("at_bit", at_bit)?;
        }
        let members: Vec<_> = elements.iter().map(|element| Member(element, records)).collect();
        map.serialize_entry("elements", &members)?;
        map.end()
    }
}

impl Serialize for Member<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(element, records) = *self;
        let mut map = serializer.serialize_map(None)?;
        write_value(&mut map, element)?;
        if matches!(element.meaning, Cow::Borrowed(_)) && !records.explain(element) {
            map.serialize_entry("meaning", &element.meaning)?;
        }
        map.end()
    }
}

impl Serialize for Alone<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("record", self.element.record)?;
        map.serialize_entry("at_bit", &self.element.at_bit)?;
        write_value(&mut map, self.element)?;
        map.serialize_entry("meaning", &self.element.meaning)?;
        map.serialize_entry("clause", self.element.clause)?;
        map.serialize_entry("hex", self.hex)?;
        map.end()
    }
}

/// Name, width and value, and what stands beside the value.
fn write_value<M: SerializeMap>(map: &mut M, element: &Element) -> Result<(), M::Error> {
    map.serialize_entry("name", &element.name)?;
    map.serialize_entry("bits", &element.bits)?;
    map.serialize_entry("value", &ValueJson(&element.value))?;
    match &element.value {
        Value::Code { name, .. } => map.serialize_entry("symbol", name),
        Value::Flags { names, .. } => map.serialize_entry("flags", names),
        Value::Words(words) => map.serialize_entry("note", words),
        Value::Spread { count, least, most } => {
            map.serialize_entry("count", count)?;
            map.serialize_entry("least", least)?;
            map.serialize_entry("most", most)
        }
        _ => Ok(()),
    }
}

impl Serialize for Fields<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|element| (&element.name, ValueJson(&element.value))))
    }
}

impl Serialize for ValueJson<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Value::Number(number) => NumberJson(*number).serialize(serializer),
            Value::List(numbers) => serializer.collect_seq(numbers.iter().copied().map(NumberJson)),
            Value::Code { number, .. } | Value::Flags { number, .. } => number.serialize(serializer),
            // Programs that keep numbers as floats lose the last bits of a digest.
            Value::Hexadecimal { number, bytes: 8 } => serializer.collect_str(&format_args!("{number:016x}")),
            Value::Hexadecimal { number, .. } => number.serialize(serializer),
            Value::Hexadecimals { numbers, .. } => numbers.serialize(serializer),
            Value::Text(text) => text.serialize(serializer),
            Value::Bytes(_) | Value::Spread { .. } | Value::Words(_) => serializer.serialize_none(),
        }
    }
}

impl Serialize for NumberJson {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Number::Unsigned(number) => number.serialize(serializer),
            Number::Signed(number) => number.serialize(serializer),
            // JSON has no other floats; null stands for them.
            Number::Float(number) => number.serialize(serializer),
        }
    }
}

/// The name of an element for the frequencies of a table.
const FREQUENCIES: &str = "length_delta, mantissa";

/// Adds an element to those of its unit. The frequencies of a table, two elements each, become one.
pub(super) fn push(elements: &mut Vec<Element>, mut element: Element) {
    let is_frequency = matches!(&*element.name, "length_delta" | "mantissa");
    match elements.last_mut() {
        Some(last) if is_frequency && last.name == FREQUENCIES => {
            last.bits = element.at_bit + element.bits - last.at_bit;
        }
        _ => {
            if is_frequency {
                element.name = Cow::Borrowed(FREQUENCIES);
                element.value = Value::Words("frequencies of the tokens".to_owned());
            }
            elements.push(element);
        }
    }
}
