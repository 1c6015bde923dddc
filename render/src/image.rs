//! Pictures, and PNG files.

use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, RgbImage};
use std::io::{BufRead, Cursor, Seek};

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
    #[error("not a picture that can be read: {0}; give a PNG, JPEG or WebP file")]
    Format(#[from] ::image::ImageError),
    /// The file could not be read.
    #[error("cannot read: {0}")]
    Io(#[from] std::io::Error),
    /// More pixels than are decoded.
    #[error("the picture has {width} x {height} pixels, at most {most} are read; give a smaller one", most = Image::MAX_PIXELS)]
    TooLarge {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
}

impl Image {
    /// Pixels that a picture may have to be decoded: 134 million, four times 8K.
    pub const MAX_PIXELS: u64 = 1 << 27;

    /// Bytes of memory that decoding takes for each pixel: the picture as it is decoded, at most 4, and as `f32`, 12. The file
    /// and what its decoder keeps for itself come on top.
    pub const DECODING_BYTES: u64 = 16;

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

    /// The picture in `width` by `height` pixels, each the mean of the area that it covers: what a camera of fewer pixels
    /// sees. Weights of pixels that are covered in part are exact, sums run in 64 bits.
    ///
    /// # Panics
    /// If a side is 0.
    #[must_use]
    #[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory")]
    #[expect(clippy::indexing_slicing, reason = "shares are of pixels of the picture")]
    pub fn averaged(&self, width: usize, height: usize) -> Self {
        assert!(width > 0 && height > 0, "a picture without pixels");
        let columns: Vec<Vec<(usize, f64)>> = (0..width).map(|x| shares(x, width, self.width)).collect();
        let mut pixels = Vec::with_capacity(width * height);
        let mut means = vec![[0.0; 3]; self.width];
        for y in 0..height {
            means.fill([0.0; 3]);
            for (line, share) in shares(y, height, self.height()) {
                let line = &self.pixels[line * self.width..][..self.width];
                for (mean, pixel) in means.iter_mut().zip(line) {
                    *mean = [0, 1, 2].map(|c| mean[c] + share * f64::from(pixel[c]));
                }
            }
            let pixel = |shares: &Vec<(usize, f64)>| {
                [0, 1, 2].map(|c| shares.iter().map(|&(x, share)| share * means[x][c]).sum::<f64>() as f32)
            };
            pixels.extend(columns.iter().map(pixel));
        }
        Self { width, pixels }
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

    /// Width and height of the picture in a file, of which no more than its head is read where the format has one.
    ///
    /// # Errors
    /// Bytes that are no PNG, JPEG or WebP file; more than [`Image::MAX_PIXELS`].
    pub fn size_of_file(file: impl BufRead + Seek) -> Result<[u32; 2], ImageError> {
        let (width, height) = ImageReader::new(file).with_guessed_format()?.into_decoder()?.dimensions();
        match u64::from(width).saturating_mul(height.into()) > Self::MAX_PIXELS {
            true => Err(ImageError::TooLarge { width, height }),
            false => Ok([width, height]),
        }
    }

    /// The picture in a PNG file; alpha is dropped, 16 bits become 8.
    ///
    /// # Errors
    /// Bytes that are no PNG file; otherwise as [`Image::decoded`], whose memory it takes.
    pub fn from_png(bytes: &[u8]) -> Result<Self, ImageError> {
        let picture = opened(bytes)?.into_rgb8();
        let pixels = picture.pixels().map(|pixel| pixel.0.map(|byte| f32::from(byte) / 255.0)).collect();
        Ok(Self::new((picture.width() as usize).max(1), pixels))
    }

    /// The picture in a PNG, JPEG or WebP file, over one colour where it lets light pass, in the values of the file. 16 bits
    /// become 8. What a JPEG file holds may differ by a level from one version of its decoder to another.
    ///
    /// Memory peaks at [`Image::DECODING_BYTES`] a pixel, 2 GiB for the largest picture that is read; 12 bytes of them stay. The
    /// bytes of the file and what the decoder keeps while it works are not among them.
    ///
    /// # Errors
    /// Bytes that are no such file; a picture of more than [`Image::MAX_PIXELS`], which is refused before it is decoded, or of
    /// more than 512 MiB as the file has it, such as 16 bits for each of four channels.
    pub fn decoded(bytes: &[u8], background: [f32; 3]) -> Result<Self, ImageError> {
        let over = |[r, g, b, a]: [u8; 4]| {
            let [r, g, b, alpha] = [r, g, b, a].map(|byte| f32::from(byte) / 255.0);
            let [back_r, back_g, back_b] = background;
            [[r, back_r], [g, back_g], [b, back_b]]
                .map(|[own, back]| if a == 255 { own } else { back + (own - back) * alpha })
        };
        // Most pictures have three channels: a fourth would be one more copy of the whole picture.
        let (width, pixels) = match opened(bytes)? {
            DynamicImage::ImageRgb8(picture) => {
                let pixels =
                    picture.pixels().map(|pixel| pixel.0.map(|byte| f32::from(byte) / 255.0)).collect();
                (picture.width(), pixels)
            }
            other => {
                let picture = other.into_rgba8();
                (picture.width(), picture.pixels().map(|pixel| over(pixel.0)).collect())
            }
        };
        Ok(Self::new((width as usize).max(1), pixels))
    }
}

/// The picture of a file as the file has it, if it has no more pixels than are read.
fn opened(bytes: &[u8]) -> Result<DynamicImage, ImageError> {
    Image::size_of_file(Cursor::new(bytes))?;
    Ok(ImageReader::new(Cursor::new(bytes)).with_guessed_format()?.decode()?)
}

/// The pixels that one of `to` pixels on an axis covers of `from`, and their shares in its mean.
#[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory")]
fn shares(at: usize, to: usize, from: usize) -> Vec<(usize, f64)> {
    // In units of a pixel divided by `to`, so that everything is whole: pixel `p` reaches from p·to to (p + 1)·to.
    let (start, end) = (at * from, (at + 1) * from);
    let covered = |pixel: usize| end.min((pixel + 1) * to) - start.max(pixel * to);
    (start / to..end.div_ceil(to)).map(|pixel| (pixel, covered(pixel) as f64 / from as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_areas_count_pixels_by_what_is_covered_of_them() {
        let line = Image::new(3, vec![[0.0; 3], [0.6; 3], [1.2; 3]]);
        let two = line.averaged(2, 1);
        for (pixel, expected) in two.pixels().iter().zip([0.2, 1.0]) {
            assert!((pixel[0] - expected).abs() < 1e-6, "{pixel:?}");
        }
        assert_eq!(line.averaged(3, 1), line);
        assert_eq!(line.averaged(1, 4).pixels(), [[0.6; 3]; 4]);
    }

    #[test]
    fn what_lets_light_pass_is_over_the_background() {
        let picture = ::image::RgbaImage::from_raw(2, 1, vec![255, 0, 51, 255, 255, 0, 51, 51]).unwrap();
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, ImageFormat::Png).unwrap();
        let read = Image::decoded(&file.into_inner(), [0.0, 1.0, 0.2]).unwrap();
        for (read, expected) in read.pixels().iter().zip([[1.0, 0.0, 0.2], [0.2, 0.8, 0.2]]) {
            assert!(
                read.iter().zip(expected).all(|(read, expected)| (read - expected).abs() < 1e-6),
                "{read:?}"
            );
        }
        assert!(Image::decoded(b"no picture", [0.0; 3]).unwrap_err().to_string().contains("JPEG"));
    }

    #[test]
    fn pictures_of_too_many_pixels_are_refused_by_their_head() {
        // A PNG file that ends after its head and the first bytes of its pixels: decoding it would fail otherwise.
        let head = |width: u32, height: u32| {
            let small = Image::new(1, vec![[0.5; 3]]).to_png().unwrap();
            let [width, height] = [width, height].map(u32::to_be_bytes);
            let kind = [b"IHDR", &width[..], &height, &small[24..29]].concat();
            let check = crc32fast::hash(&kind).to_be_bytes();
            [&small[..12], &kind, &check, &small[33..]].concat()
        };
        let size = |width, height| Image::size_of_file(Cursor::new(head(width, height)));
        assert_eq!(size(16_384, 8192).unwrap(), [16_384, 8192]);
        let said = size(13_300, 13_296).unwrap_err().to_string();
        assert!(said.contains("13300 x 13296 pixels, at most 134217728"), "{said}");
        let bytes = head(16_384, 8193);
        for refused in [Image::decoded(&bytes, [0.0; 3]), Image::from_png(&bytes)] {
            assert!(matches!(refused, Err(ImageError::TooLarge { width: 16_384, height: 8193 })));
        }
    }

    #[test]
    fn pictures_of_other_channels_are_read_too() {
        let mut file = Cursor::new(Vec::new());
        let grey =
            ::image::ImageBuffer::<::image::Luma<u16>, _>::from_raw(2, 1, vec![0_u16, 0xffff]).unwrap();
        grey.write_to(&mut file, ImageFormat::Png).unwrap();
        let bytes = file.into_inner();
        for read in [Image::decoded(&bytes, [0.5; 3]).unwrap(), Image::from_png(&bytes).unwrap()] {
            assert_eq!(read.pixels(), [[0.0; 3], [1.0; 3]]);
        }
    }

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
