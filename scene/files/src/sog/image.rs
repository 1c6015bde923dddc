//! WebP images as plain pixels.

use std::io::Cursor;

use image::ImageDecoder;
use image::codecs::webp::WebPDecoder;

use crate::error::SceneError;
use crate::limits::Budget;

const EXPORT: &str = "the file is damaged, or not lossless WebP; export the scene again";

/// Bytes a pixel that the decoder takes for itself, at most.
const DECODER_BYTES: u64 = 8;

/// Pixels, row by row. Opaque images have no alpha channel and read as alpha 255.
pub(crate) struct Image {
    pub(crate) width: usize,
    pixels: Vec<u8>,
    channels: usize,
}

impl Image {
    /// Decodes the WebP file `name`, unless it has more pixels than `most`: a few bytes can stand for many.
    pub(crate) fn decode(
        name: &str,
        webp: &[u8],
        most: u64,
        budget: &mut Budget,
    ) -> Result<Self, SceneError> {
        let refuse = |error| SceneError::inconsistent(format!("{name}: {error}"), EXPORT);
        let decoder = WebPDecoder::new(Cursor::new(webp)).map_err(refuse)?;
        let (width, height) = decoder.dimensions();
        let pixels = u64::from(width).saturating_mul(height.into());
        if pixels > most {
            let what = format!("{name} has {pixels} pixels, {most} are more than enough");
            return Err(SceneError::inconsistent(what, EXPORT));
        }
        let channels = usize::from(decoder.color_type().channel_count());
        // The decoder has pixels of its own, and a cache of colours.
        let working = pixels.saturating_mul(DECODER_BYTES);
        budget.take(working, "a WebP decoder")?;
        let total = decoder.total_bytes();
        let mut pixels = budget.room(total, "an image")?;
        pixels.resize(usize::try_from(total).unwrap_or(0), 0);
        decoder.read_image(&mut pixels).map_err(refuse)?;
        budget.give_back(working);
        Ok(Self { width: width as usize, pixels, channels })
    }

    /// Red, green, blue, alpha of every pixel.
    pub(crate) fn pixels(&self) -> impl ExactSizeIterator<Item = [u8; 4]> + '_ {
        self.pixels.chunks_exact(self.channels).map(|pixel| match *pixel {
            [red, green, blue] => [red, green, blue, 255],
            [red, green, blue, alpha, ..] => [red, green, blue, alpha],
            // WebP decodes to three or four channels only.
            _ => [0, 0, 0, 255],
        })
    }

    /// How many pixels.
    pub(crate) fn len(&self) -> usize {
        self.pixels.len().checked_div(self.channels).unwrap_or(0)
    }
}
