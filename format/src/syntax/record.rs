//! The bytes of fixed records: numbers one after another, least significant byte first, arrays in order.

/// A record of clause 5 as bytes, before anybody looks at its values.
pub trait FixedRecord: Sized {
    /// The record at the start of `bytes`, which afterwards start behind it; none where they end early.
    fn take(bytes: &mut &[u8]) -> Option<Self>;

    /// Appends the bytes of the record.
    fn put(&self, out: &mut Vec<u8>);
}

/// An element of a fixed record: a number or an array of numbers.
pub(crate) trait Element: Sized {
    /// The element at the start of `bytes`, which afterwards start behind it; none where they end early.
    fn take(bytes: &mut &[u8]) -> Option<Self>;

    /// Appends the bytes of the element.
    fn put(&self, out: &mut Vec<u8>);
}

macro_rules! number {
    ($($Number:ty)+) => { $(
        impl Element for $Number {
            fn take(bytes: &mut &[u8]) -> Option<Self> {
                let (first, rest) = bytes.split_first_chunk()?;
                *bytes = rest;
                Some(Self::from_le_bytes(*first))
            }

            fn put(&self, out: &mut Vec<u8>) {
                out.extend(self.to_le_bytes());
            }
        }
    )+ };
}
number!(u8 i8 u16 u32 i32 u64);

impl<T: Element + Copy + Default, const N: usize> Element for [T; N] {
    fn take(bytes: &mut &[u8]) -> Option<Self> {
        let mut array = [T::default(); N];
        for element in &mut array {
            *element = T::take(bytes)?;
        }
        Some(array)
    }

    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|element| element.put(out));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_little_endian_and_arrays_in_order() {
        let mut bytes: &[u8] = &[1, 2, 3, 4, 0xff, 7];
        assert_eq!(<[u16; 2]>::take(&mut bytes), Some([0x0201, 0x0403]));
        assert_eq!(i8::take(&mut bytes), Some(-1));
        assert_eq!(u16::take(&mut bytes), None, "one byte is left");
        let mut out = Vec::new();
        [0x0201_u16, 0x0403].put(&mut out);
        assert_eq!(out, [1, 2, 3, 4]);
    }
}
