//! What writers of formats with few bits cannot keep.

/// Values of one property that lie outside the range of a format: its writer puts them at the end of the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clamped {
    /// The property: `dc`, `log_scale` or `sh`.
    pub property: &'static str,
    /// How many values, 1 or more.
    pub count: u64,
    /// The first Gaussian with such a value.
    pub row: usize,
    /// That value.
    pub value: f32,
}

impl Clamped {
    /// The values of a property that are outside; each plane has one value per Gaussian.
    pub(crate) fn of<'a>(
        property: &'static str,
        planes: impl IntoIterator<Item = &'a Vec<f32>>,
        is_outside: impl Fn(usize, f32) -> bool,
    ) -> Option<Self> {
        let mut found: Option<Self> = None;
        for (plane, values) in planes.into_iter().enumerate() {
            for (row, &value) in values.iter().enumerate().filter(|&(_, &value)| is_outside(plane, value)) {
                let known = found.get_or_insert(Self { property, count: 0, row, value });
                known.count = known.count.saturating_add(1);
                if row < known.row {
                    (known.row, known.value) = (row, value);
                }
            }
        }
        found
    }
}

/// Whether the nearest integer to a value is no byte.
pub(crate) fn is_no_byte(value: f64) -> bool {
    !(0.0..=255.0).contains(&value.round())
}
