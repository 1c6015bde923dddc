//! The printers of tables.

use super::{Column, Medium, Row, Value};
use crate::Error;
use crate::table::Table;
use maud::{Markup, html};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// The columns that a medium has of some rows, and the cells of each row.
fn cells<R: Row>(rows: &[R], medium: Medium) -> (Vec<Column<R>>, Vec<Vec<Value>>) {
    let is_for_people = super::PEOPLE.contains(&medium);
    let is_printed = |column: &Column<R>| {
        let is_missing = || !rows.iter().any(|row| (column.value)(row).is_there());
        column.media.contains(&medium) && !(column.optional && is_for_people && is_missing())
    };
    let columns: Vec<Column<R>> = R::columns(rows).into_iter().filter(is_printed).collect();
    let of_row = |row: &R| columns.iter().map(|column| (column.value)(row)).collect();
    let cells = rows.iter().map(of_row).collect();
    (columns, cells)
}

/// The rows of each scene as a file, with the scene in the first column.
///
/// # Errors
/// A table cannot be written as CSV.
pub(crate) fn csv<'a, R: Row + 'a>(
    scenes: impl IntoIterator<Item = (&'a str, Vec<R>)>,
) -> Result<Vec<u8>, Error> {
    let failed = |error: String| Error::other(format!("a table cannot be written as CSV: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = R::columns(&[]).into_iter().filter(|column| column.media.contains(&Medium::File));
    let names = columns.map(|column| column.name.into_owned());
    let headings = core::iter::once("scene".to_owned()).chain(names);
    writer.write_record(headings).map_err(|error| failed(error.to_string()))?;
    for (scene, rows) in scenes {
        for row in cells(&rows, Medium::File).1 {
            let record = core::iter::once(scene.to_owned()).chain(row.iter().map(Value::exact));
            writer.write_record(record).map_err(|error| failed(error.to_string()))?;
        }
    }
    writer.into_inner().map_err(|error| failed(error.to_string()))
}

/// A row as an object of JSON.
pub(crate) fn object<R: Row, S: Serializer>(row: &R, serializer: S) -> Result<S::Ok, S::Error> {
    let columns = R::columns(core::slice::from_ref(row)).into_iter();
    let columns: Vec<Column<R>> = columns.filter(|column| column.media.contains(&Medium::Json)).collect();
    let mut map = serializer.serialize_map(Some(columns.len()))?;
    for column in &columns {
        map.serialize_entry(&column.name, &(column.value)(row))?;
    }
    map.end()
}

/// Rows as an array of JSON.
pub(crate) fn objects<R: Row, S: Serializer>(rows: &[R], serializer: S) -> Result<S::Ok, S::Error> {
    /// A row that serialises.
    struct Object<'a, R>(&'a R);
    impl<R: Row> Serialize for Object<'_, R> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            object(self.0, serializer)
        }
    }
    serializer.collect_seq(rows.iter().map(Object))
}

/// Text in columns.
pub(crate) fn text<R: Row>(rows: &[R]) -> String {
    let (columns, cells) = cells(rows, Medium::Terminal);
    // A terminal has no use for places where a word may be divided.
    let heading = |column: Column<R>| column.heading.replace('\u{ad}', "");
    let mut table = Table::of(columns.into_iter().map(heading).collect());
    for row in cells {
        table.add(row.iter().map(Value::readable).collect());
    }
    table.text()
}

/// A table of the page, which scrolls where it is wider than the screen.
pub(crate) fn html<R: Row>(rows: &[R]) -> Markup {
    let (columns, cells) = cells(rows, Medium::Page);
    let is_words =
        |column: usize| cells.iter().filter_map(|row: &Vec<Value>| row.get(column)).any(Value::is_words);
    html! {
        div.scroll tabindex="0" {
            table {
                thead {
                    tr {
                        @for (index, column) in columns.iter().enumerate() {
                            th class=[is_words(index).then_some("text")] scope="col" { (column.heading) }
                        }
                    }
                }
                tbody { @for (row, cells) in rows.iter().zip(&cells) { (table_row(row, cells)) } }
            }
        }
    }
}

fn table_row<R: Row>(row: &R, cells: &[Value]) -> Markup {
    let (first, rest) = cells.split_first().map_or((&Value::None, cells), |parts| parts);
    html! {
        tr class=[row.stands_out().then_some("baseline")] {
            th scope="row" {
                @match row.part_of_page() {
                    Some(part) => a href=(format!("#{part}")) { (typeset(first)) },
                    None => (typeset(first)),
                }
            }
            @for cell in rest { td class=[cell.is_words().then_some("text")] { (typeset(cell)) } }
        }
    }
}

/// With a real minus sign, and a dash for nothing.
fn typeset(value: &Value) -> String {
    let text = value.readable();
    match value {
        Value::Words(words) if !words.is_empty() => text,
        Value::Words(_) | Value::None => "–".to_owned(),
        _ => text.replace('-', "−"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fruit {
        name: &'static str,
        grams: Option<f64>,
        ripe: Option<f64>,
    }

    impl Row for Fruit {
        fn columns(_: &[Self]) -> Vec<Column<Self>> {
            vec![
                Column::new("name", "Fruit", |row: &Self| Value::words(row.name)),
                Column::new("mass_g", "Mass, g", |row: &Self| Value::number(row.grams, 1)),
                Column::new("ripe", "Ripe", |row: &Self| Value::number(row.ripe, 0)).if_measured(),
                Column::of_file("letters", |row: &Self| Value::Count(row.name.len() as u64)),
            ]
        }
    }

    const FRUITS: [Fruit; 2] = [
        Fruit { name: "pear", grams: Some(-0.01), ripe: None },
        Fruit { name: "fig", grams: None, ripe: None },
    ];

    #[test]
    fn one_description_makes_every_table() {
        let file = csv([("garden", FRUITS.into())]).unwrap();
        let lines = "scene,name,mass_g,ripe,letters\ngarden,pear,-0.010000,,4\ngarden,fig,,,3\n";
        assert_eq!(String::from_utf8(file).unwrap(), lines);
        assert_eq!(text(&FRUITS), "Fruit  Mass, g\npear       0.0\nfig          -\n");
        let json = object(&FRUITS[0], serde_json::value::Serializer).unwrap();
        assert_eq!(json, serde_json::json!({"name": "pear", "mass_g": -0.01, "ripe": null}));
        let page = html(&FRUITS).into_string();
        assert!(page.contains("<td>0.0</td>") && page.contains("<td>–</td>"), "{page}");
        assert!(!page.contains("Ripe") && !page.contains("letters"), "{page}");
    }

    #[test]
    fn a_file_without_rows_has_its_headings() {
        assert_eq!(csv::<Fruit>([]).unwrap(), b"scene,name,mass_g,ripe,letters\n");
    }
}
