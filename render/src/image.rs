//! Pictures, and PNG files.

use ::image::{ImageFormat, ImageReader, RgbImage};
use std::io::Cursor;

/// A picture: red, green, blue as `f32`, row by row from the top left. 0 is black and 1 the brightest that a
/// file holds; a rendering may go above.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    pixels: Vec<[f32; 3]>,
}

/// Why bytes are no picture that can be used.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The decoder of the file format refused.
    #[error("not a picture that can be read: {0}; give a PNG file")]
    Format(#[from] ::image::ImageError),
    /// The file could not be read.
    #[error("cannot read: {0}")]
    Io(#[from] std::io::Error),
}

impl Image {
    /// A picture of `pixels`, `width` to a row.
    ///
    /// # Panics
    /// If the pixels do not fill their last row.
    pub fn new(width: usize, pixels: Vec<[f32; 3]>) -> Self {
        assert!(width > 0 && pixels.len().is_multiple_of(width), "the last row of a picture is not full");
        Self { width, pixels }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[expect(clippy::arithmetic_side_effects, reason = "a picture has a width of 1 or more")]
    pub fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// All pixels, row by row from the top left.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// The picture as a PNG file of 8 bits a channel: clamped to 0..1, rounded half up.
    ///
    /// # Errors
    /// What the encoder refuses: a side above 2^31.
    pub fn to_png(&self) -> Result<Vec<u8>, ImageError> {
        let bytes = self.pixels.iter().flatten().map(|&value| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
        let size = (self.width as u32, self.height() as u32);
        let picture = RgbImage::from_raw(size.0, size.1, bytes.collect()).unwrap_or_default();
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, ImageFormat::Png)?;
        Ok(file.into_inner())
    }

    /// The picture in a PNG file; alpha is dropped, 16 bits become 8.
    ///
    /// # Errors
    /// Bytes that are no PNG file.
    pub fn from_png(bytes: &[u8]) -> Result<Self, ImageError> {
        let picture = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?.decode()?.to_rgb8();
        let pixels = picture.pixels().map(|pixel| pixel.0.map(|byte| f32::from(byte) / 255.0)).collect();
        Ok(Self::new((picture.width() as usize).max(1), pixels))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_back_from_png_to_the_nearest_step() {
        let picture = Image::new(2, vec![[0.0, 0.5, 1.0], [-1.0, 2.0, 0.2], [0.1; 3], [0.9; 3]]);
        let read = Image::from_png(&picture.to_png().unwrap()).unwrap();
        assert_eq!((read.width(), read.height()), (2, 2));
        for (&written, &read) in picture.pixels().iter().flatten().zip(read.pixels().iter().flatten()) {
            assert!((written.clamp(0.0, 1.0) - read).abs() <= 0.5 / 255.0 + 1e-6, "{written} {read}");
        }
    }
}
