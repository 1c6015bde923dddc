//! Accessors: typed values in the bytes of a buffer view.

use super::buffers::Buffers;
use super::document::{Document, broken};
use crate::error::SceneError;

/// The type of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    F32,
}

/// The numbers that glTF gives to types of components.
pub(super) const FLOAT: u32 = 5126;
pub(super) const UNSIGNED_BYTE: u32 = 5121;

impl Component {
    fn of(number: u32) -> Option<Self> {
        match number {
            5120 => Some(Self::I8),
            UNSIGNED_BYTE => Some(Self::U8),
            5122 => Some(Self::I16),
            5123 => Some(Self::U16),
            FLOAT => Some(Self::F32),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::F32 => 4,
        }
    }

    /// What stands for 1 in a normalised integer.
    fn one(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::F32 => 1.0,
        }
    }

    fn decode(self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 4];
        wide.iter_mut().zip(bytes).for_each(|(to, &from)| *to = from);
        let [a, b, ..] = wide;
        match self {
            Self::I8 => f64::from(a.cast_signed()),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::F32 => f64::from(f32::from_le_bytes(wide)),
        }
    }
}

/// The values of an accessor, `N` components each; all are there.
pub(super) struct Values<'a, const N: usize> {
    bytes: &'a [u8],
    stride: usize,
    component: Component,
    normalized: bool,
    pub(super) count: u64,
}

impl<'a, const N: usize> Values<'a, N> {
    /// The values of an attribute.
    pub(super) fn of(
        document: &'a Document,
        buffers: &'a Buffers<'_>,
        (name, index): (&str, u32),
    ) -> Result<Self, SceneError> {
        let wrong = |what: String| broken(format!("accessor {index} ({}) {what}", name.escape_default()));
        let accessor = document.accessors.get(index as usize).ok_or_else(|| wrong("is not there".into()))?;
        let expected = match N {
            1 => "SCALAR",
            3 => "VEC3",
            _ => "VEC4",
        };
        if accessor.kind != expected {
            return Err(wrong(format!("is a {}, {expected} is needed", accessor.kind.escape_default())));
        }
        let component = Component::of(accessor.component_type)
            .ok_or_else(|| wrong(format!("has components of the type {}", accessor.component_type)))?;
        if accessor.sparse.is_some() {
            let what = format!("glTF: accessor {index} ({}) is sparse", name.escape_default());
            return Err(SceneError::unsupported(what, "export the file without sparse accessors"));
        }
        let view = accessor.buffer_view.ok_or_else(|| wrong("has no buffer view, hence no values".into()))?;
        let (bytes, view) = buffers.view(document, view)?;
        let size = component.size().saturating_mul(N);
        let stride = view.byte_stride.map_or(size, |stride| usize::try_from(stride).unwrap_or(usize::MAX));
        if stride < size {
            return Err(wrong(format!("has a value of {size} bytes every {stride} bytes")));
        }
        let needed =
            accessor.count.saturating_sub(1).saturating_mul(stride as u64).saturating_add(size as u64);
        let offset = usize::try_from(accessor.byte_offset).unwrap_or(usize::MAX);
        let bytes = bytes.get(offset..).unwrap_or_default();
        if accessor.count > 0 && needed > bytes.len() as u64 {
            return Err(wrong(format!("needs {needed} bytes, its buffer view has {}", bytes.len())));
        }
        Ok(Self { bytes, stride, component, normalized: accessor.normalized, count: accessor.count })
    }

    /// Half the distance between two neighbouring values that are from 0 to 1; of floats next to nothing.
    pub(super) fn half_step(&self) -> f64 {
        match self.component {
            Component::F32 => 1e-9,
            integer => 0.5 / integer.one(),
        }
    }

    /// One value after another.
    pub(super) fn iter(&self) -> impl Iterator<Item = [f64; N]> + '_ {
        let (size, count) = (self.component.size(), usize::try_from(self.count).unwrap_or(usize::MAX));
        let one = if self.normalized { self.component.one() } else { 1.0 };
        let value = move |row: &[u8]| {
            let mut value = [0.0; N];
            let parts = row.chunks_exact(size).map(|part| self.component.decode(part) / one);
            // A normalised integer may be one step below -1, which means -1.
            let least = if self.normalized { -1.0 } else { f64::NEG_INFINITY };
            value.iter_mut().zip(parts).for_each(|(to, part)| *to = if part < least { least } else { part });
            value
        };
        self.bytes.chunks(self.stride).take(count).map(value)
    }
}
