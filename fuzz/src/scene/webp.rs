//! Lossless WebP images, written without a search: an input decides each pixel.

/// How the pixels of an image are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    /// Each channel of each pixel in eight bits.
    Literal,
    /// All pixels alike, in no bits at all.
    Plain,
}

/// An image of so many pixels, 16384 by 16384 at most; red, green, blue and alpha of each pixel. Pixels may lack.
pub(super) fn image(width: u16, height: u16, coding: Coding, pixels: &[u8]) -> Vec<u8> {
    let mut bits = Bits::default();
    bits.put(0x2f, 8);
    bits.put(width.into(), 14);
    bits.put(height.into(), 14);
    // There is alpha, version 0, no transform, no colour cache, one set of prefix codes.
    bits.put(1, 1);
    bits.put(0, 3 + 1 + 1 + 1);
    let first = pixels.first_chunk().copied().unwrap_or([0, 0, 0, 255]);
    for (symbols, channel) in [(256 + 24, 1), (256, 0), (256, 2), (256, 3)] {
        match coding {
            Coding::Literal => bits.literal_code(symbols),
            Coding::Plain => bits.code_of(first[channel]),
        }
    }
    bits.code_of(0);
    if coding == Coding::Literal {
        for &[red, green, blue, alpha] in pixels.as_chunks::<4>().0 {
            // Codes stand with their first bit first.
            [green, red, blue, alpha].iter().for_each(|byte| bits.put(byte.reverse_bits().into(), 8));
        }
    }
    let mut data = bits.bytes;
    data.resize(data.len().next_multiple_of(2), 0);
    let chunk = [&b"WEBPVP8L"[..], &(data.len() as u32).to_le_bytes(), &data].concat();
    [&b"RIFF"[..], &(chunk.len() as u32).to_le_bytes(), &chunk].concat()
}

/// Bits, the lowest of a byte first.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    count: usize,
}

impl Bits {
    fn put(&mut self, value: u32, count: u32) {
        for bit in 0..count {
            if self.count.is_multiple_of(8) {
                self.bytes.push(0);
            }
            if let Some(last) = self.bytes.last_mut() {
                *last |= ((value >> bit & 1) as u8) << (self.count % 8);
            }
            self.count += 1;
        }
    }

    /// A prefix code of one symbol, which takes no bits.
    fn code_of(&mut self, symbol: u8) {
        self.put(1, 1);
        self.put(0, 1);
        self.put(1, 1);
        self.put(symbol.into(), 8);
    }

    /// A prefix code of an alphabet whose first 256 symbols are eight bits long and whose others do not occur.
    fn literal_code(&mut self, symbols: u32) {
        self.put(0, 1);
        // The lengths 0 and 8, the third and the twelfth in the order of the format, are one bit long.
        self.put(12 - 4, 4);
        (0..12).for_each(|place| self.put(u32::from(matches!(place, 2 | 11)), 3));
        self.put(0, 1);
        (0..symbols).for_each(|symbol| self.put(u32::from(symbol < 256), 1));
    }
}
