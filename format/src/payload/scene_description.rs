//! 5.9 scene_description: what a viewer may want to know about the scene.

use super::{after_fixed_part, length, write_leb128};
use crate::syntax::reader::Reader;
use crate::syntax::{Camera, SceneDescriptionHeader, Spot, in_range};
use crate::{Error, ErrorKind, Result};

/// Bytes of a title, at most.
const MAX_TITLE: u32 = 1024;
/// Cameras, at most.
const MAX_CAMERAS: u32 = 64;

/// Declares an enumeration whose codes count from 0.
macro_rules! codes {
    ($(#[doc = $doc:literal])+ $Name:ident { $( #[doc = $meaning:literal] $Value:ident = $code:literal $name:literal, )+ }) => {
        $(#[doc = $doc])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
        pub enum $Name {
            #[default]
            $( #[doc = $meaning] $Value, )+
        }

        impl $Name {
            /// Every value, in the order of the codes.
            pub const ALL: &'static [Self] = &[ $( Self::$Value, )+ ];

            /// The code in the stream.
            pub const fn code(self) -> u8 {
                match self { $( Self::$Value => $code, )+ }
            }

            /// The value of a code; others are reserved.
            pub fn from_code(code: u8) -> Option<Self> {
                Self::ALL.get(usize::from(code)).copied()
            }

            /// The name used in reports.
            pub const fn name(self) -> &'static str {
                match self { $( Self::$Value => $name, )+ }
            }
        }
    };
}

codes! {
    /// The direction that points up in the scene.
    UpAxis {
        /// Not known.
        Unknown = 0 "unknown",
        /// Along x.
        PlusX = 1 "+x",
        /// Against x.
        MinusX = 2 "-x",
        /// Along y.
        PlusY = 3 "+y",
        /// Against y.
        MinusY = 4 "-y",
        /// Along z.
        PlusZ = 5 "+z",
        /// Against z.
        MinusZ = 6 "-z",
    }
}

codes! {
    /// What colours are, with the primaries of BT.709, display-referred.
    ColourSpace {
        /// Encoded with the transfer function of sRGB.
        Srgb = 0 "sRGB",
        /// Linear.
        Linear = 1 "linear",
    }
}

codes! {
    /// What Gaussians are sorted by when they are drawn.
    Sorting {
        /// Their distance to the camera.
        Distance = 0 "distance",
        /// Their depth along the view axis.
        Depth = 1 "depth",
    }
}

/// What a viewer may want to know about the scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SceneDescription {
    /// The direction that points up.
    pub up_axis: UpAxis,
    /// What colours are.
    pub colour_space: ColourSpace,
    /// What Gaussians are sorted by.
    pub sorting: Sorting,
    /// Metres of a scene unit, above 0.
    pub metres_per_unit: Option<f32>,
    /// Red, green and blue of the background, 0 to 1.
    pub background: Option<[f32; 3]>,
    /// The smallest and the largest position.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// 1 to 1024 bytes.
    pub title: Option<String>,
    /// From where the scene may be viewed, at most 64.
    pub cameras: Vec<Camera>,
}

/// The elements after the fixed part, and what clause 6.9 says of them.
struct Elements<'r, 'a, 't>(&'r mut Reader<'a, 't>);

impl Elements<'_, '_, '_> {
    fn spot(&self, at: u64, element: &'static str) -> Spot {
        Spot { at, clause: SceneDescriptionHeader::TABLE.semantics, element }
    }

    /// Numbers in the range that all have, for each of which `holds`.
    fn numbers<const N: usize>(
        &mut self,
        element: &'static str,
        rule: &'static str,
        holds: impl Fn(usize, f32) -> bool,
    ) -> Result<[f32; N]> {
        let at = self.0.at();
        let values: [f32; N] = self.0.f32s(element)?;
        let fits =
            values.into_iter().enumerate().all(|(index, value)| in_range(value) && holds(index, value));
        self.spot(at, element).rule(fits, rule)?;
        Ok(values)
    }

    /// A count from 1 to `max`.
    fn count(&mut self, element: &'static str, max: u32) -> Result<u32> {
        let at = self.0.at();
        let count = self.0.number(element)?;
        self.spot(at, element).range(count, 1, max)?;
        Ok(count)
    }

    fn bounds(&mut self) -> Result<[[f32; 3]; 2]> {
        let min: [f32; 3] = self.numbers("bounds_min", "bounds are between -2^40 and 2^40", |_, _| true)?;
        let rule = "bounds_max is not below bounds_min and at most 2^40";
        let not_below = |index: usize, value: f32| min.get(index).is_some_and(|min| *min <= value);
        Ok([min, self.numbers("bounds_max", rule, not_below)?])
    }

    fn title(&mut self) -> Result<String> {
        let bytes = self.count("title_length", MAX_TITLE)?;
        let at = self.0.at();
        let title = core::str::from_utf8(self.0.take("title", length(bytes))?);
        self.spot(at, "title").rule(title.is_ok(), "the title is UTF-8")?;
        Ok(title.unwrap_or_default().to_owned())
    }

    fn cameras(&mut self) -> Result<Vec<Camera>> {
        let count = self.count("camera_count", MAX_CAMERAS)?;
        let mut cameras = Vec::new();
        for index in 0..length(count) {
            let at = self.0.at();
            let bytes = self.0.take_indexed("cameras", Some(index), Camera::SIZE)?;
            cameras.push(Camera::parse(bytes, at)?.0);
        }
        Ok(cameras)
    }
}

impl SceneDescription {
    /// Reads and checks a payload that stands at offset `at`.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over, or a number is not in its shortest form. Unsupported:
    /// reserved values and flags. Invalid: a value that clause 6.9 forbids.
    pub fn parse(payload: &[u8], at: u64) -> Result<Self> {
        let (header, rest) = SceneDescriptionHeader::parse(payload, at)?;
        Self::read(&header, &mut after_fixed_part(&SceneDescriptionHeader::TABLE, rest, at))
    }

    /// Reads what follows a header that has been accepted.
    pub(crate) fn read(header: &SceneDescriptionHeader, reader: &mut Reader<'_, '_>) -> Result<Self> {
        const METRES: &str = "metres_per_unit is above 0 and at most 2^40";
        const BACKGROUND: &str = "a background is between 0 and 1";
        reader.record(SceneDescriptionHeader::TABLE.name, SceneDescriptionHeader::TABLE.syntax);
        let mut scene = Self {
            up_axis: UpAxis::from_code(header.up_axis).unwrap_or_default(),
            colour_space: ColourSpace::from_code(header.colour_space).unwrap_or_default(),
            sorting: Sorting::from_code(header.sorting).unwrap_or_default(),
            ..Self::default()
        };
        let has = |flag: u8| header.description_flags & flag != 0;
        let mut elements = Elements(reader);
        if has(SceneDescriptionHeader::METRES) {
            let [metres] = elements.numbers("metres_per_unit", METRES, |_, value| value > 0.0)?;
            scene.metres_per_unit = Some(metres);
        }
        if has(SceneDescriptionHeader::BACKGROUND) {
            let in_unit = |_, value| (0.0..=1.0).contains(&value);
            scene.background = Some(elements.numbers("background", BACKGROUND, in_unit)?);
        }
        if has(SceneDescriptionHeader::BOUNDS) {
            scene.bounds = Some(elements.bounds()?);
        }
        if has(SceneDescriptionHeader::TITLE) {
            scene.title = Some(elements.title()?);
        }
        if has(SceneDescriptionHeader::CAMERAS) {
            scene.cameras = elements.cameras()?;
        }
        reader.end()?;
        Ok(scene)
    }

    /// The bytes of the payload; refused where [`Self::parse`] would refuse them. Offsets of errors count from the
    /// start of the payload.
    ///
    /// # Errors
    /// Those of [`Self::parse`].
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let flags = [
            (self.metres_per_unit.is_some(), SceneDescriptionHeader::METRES),
            (self.background.is_some(), SceneDescriptionHeader::BACKGROUND),
            (self.bounds.is_some(), SceneDescriptionHeader::BOUNDS),
            (self.title.is_some(), SceneDescriptionHeader::TITLE),
            (!self.cameras.is_empty(), SceneDescriptionHeader::CAMERAS),
        ];
        let header = SceneDescriptionHeader {
            up_axis: self.up_axis.code(),
            kernel: 0,
            colour_space: self.colour_space.code(),
            projection: 0,
            sorting: self.sorting.code(),
            description_flags: flags.into_iter().filter(|(set, _)| *set).fold(0, |all, (_, flag)| all | flag),
        };
        let mut bytes = header.to_bytes()?;
        let numbers = self.metres_per_unit.into_iter().chain(self.background.into_iter().flatten());
        let numbers = numbers.chain(self.bounds.into_iter().flatten().flatten());
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        if let Some(title) = &self.title {
            write_count(title.len(), &mut bytes)?;
            bytes.extend_from_slice(title.as_bytes());
        }
        if !self.cameras.is_empty() {
            write_count(self.cameras.len(), &mut bytes)?;
        }
        for camera in &self.cameras {
            bytes.extend(camera.to_bytes()?);
        }
        Self::parse(&bytes, 0)?;
        Ok(bytes)
    }
}

/// A count that a reader then finds in its range.
fn write_count(count: usize, bytes: &mut Vec<u8>) -> Result<()> {
    let kind = ErrorKind::Constraint { rule: "counts are below 2^32" };
    let count =
        u32::try_from(count).map_err(|_| Error::new(0, SceneDescriptionHeader::TABLE.semantics, kind))?;
    write_leb128(count, bytes);
    Ok(())
}
