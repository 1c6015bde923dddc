//! The file of the weights.

use super::convolution::Convolution;
use super::{Layer, StLpips, npy};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use zip::ZipArchive;
use zip::result::ZipError;

/// Name, outputs, inputs and side of the kernel of each layer.
const LAYERS: [(&str, [usize; 3]); 5] = [
    ("net.slice1.0", [64, 3, 11]),
    ("net.slice2.5", [192, 64, 5]),
    ("net.slice3.9", [384, 192, 3]),
    ("net.slice4.11", [256, 384, 3]),
    ("net.slice5.13", [256, 256, 3]),
];
/// The longest header that is read of an array, bytes.
const HEADER: u64 = 4096;

/// Why a file holds no weights.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// The file could not be read.
    #[error("cannot read the weights: {0}")]
    Io(#[from] io::Error),
    /// The file is no archive, or a damaged one.
    #[error("no archive of arrays: {0}; give the .npz file of the metric")]
    Archive(#[from] ZipError),
    /// An array is not in the archive.
    #[error("no array {0} in the weights")]
    Missing(String),
    /// An array is no file of NumPy with 32-bit floats in the order of C, or is larger than it should be.
    #[error("the array {0} in the weights is not one of 32-bit floats in the order of C, or too large")]
    Format(String),
    /// An array has another shape.
    #[error("the array {name} in the weights has the shape {found:?}, not {expected:?}")]
    Shape {
        /// The array.
        name: String,
        /// Its shape.
        found: Vec<u64>,
        /// The shape in the network.
        expected: Vec<u64>,
    },
    /// An array holds an infinite value or a NaN.
    #[error("the array {0} in the weights has values that are not finite")]
    NotFinite(String),
}

/// Reads the weights. The blurs, which are in the file too, are not read: they are the same in each channel.
pub(super) fn read(path: &Path) -> Result<StLpips, WeightsError> {
    read_archive(File::open(path)?)
}

#[expect(clippy::indexing_slicing, reason = "an array of known length")]
fn read_archive(file: File) -> Result<StLpips, WeightsError> {
    let mut archive = ZipArchive::new(file)?;
    let mut three = |name: &str| -> Result<[f32; 3], WeightsError> {
        let values = array(&mut archive, name.to_owned(), &[1, 3, 1, 1])?;
        Ok([values[0], values[1], values[2]])
    };
    let (shift, scale) = (three("scaling_layer.shift")?, three("scaling_layer.scale")?);
    let mut layer = |index: usize| -> Result<Layer, WeightsError> {
        let (name, size) = LAYERS[index];
        let [outputs, inputs, side] = size;
        let weights = array(&mut archive, format!("{name}.weight"), &[outputs, inputs, side, side])?;
        let bias = array(&mut archive, format!("{name}.bias"), &[outputs])?;
        let channel_weights = array(&mut archive, format!("lin{index}.model.1.weight"), &[1, outputs, 1, 1])?;
        Ok(Layer { convolution: Convolution::new(size, &weights, &bias), channel_weights })
    };
    let layers = [layer(0)?, layer(1)?, layer(2)?, layer(3)?, layer(4)?];
    Ok(StLpips { shift, scale, layers })
}

/// The values of an array, as many as its shape says.
#[expect(clippy::arithmetic_side_effects, reason = "sizes of the arrays of one network")]
fn array(archive: &mut ZipArchive<File>, name: String, shape: &[usize]) -> Result<Vec<f32>, WeightsError> {
    let mut entry = match archive.by_name(&format!("{name}.npy")) {
        Err(ZipError::FileNotFound) => return Err(WeightsError::Missing(name)),
        entry => entry?,
    };
    let expected: Vec<u64> = shape.iter().map(|&axis| axis as u64).collect();
    let mut file = Vec::new();
    // What the file claims of its size is not trusted: one byte more than the largest shows that it is larger.
    let largest = 4 * expected.iter().product::<u64>() + HEADER;
    entry.by_ref().take(largest + 1).read_to_end(&mut file)?;
    let Some(array) = npy::read(&file).filter(|_| file.len() as u64 <= largest) else {
        return Err(WeightsError::Format(name));
    };
    if array.shape != expected {
        return Err(WeightsError::Shape { name, found: array.shape, expected });
    }
    if array.values.iter().any(|value| !value.is_finite()) {
        return Err(WeightsError::NotFinite(name));
    }
    Ok(array.values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use zip::write::{SimpleFileOptions, ZipWriter};

    /// What reading an archive of one array says.
    fn refusal(name: &str, shape: &str, values: &[f32]) -> String {
        let mut archive = ZipWriter::new(tempfile::tempfile().unwrap());
        archive.start_file(name, SimpleFileOptions::default()).unwrap();
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
        archive.write_all(b"\x93NUMPY\x01\x00").unwrap();
        archive.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
        archive.write_all(header.as_bytes()).unwrap();
        for value in values {
            archive.write_all(&value.to_le_bytes()).unwrap();
        }
        read_archive(archive.finish().unwrap()).unwrap_err().to_string()
    }

    #[test]
    fn a_refusal_names_the_array() {
        let shift = "scaling_layer.shift.npy";
        let cases = [
            (refusal("other.npy", "(1,)", &[0.0]), "no array scaling_layer.shift "),
            (refusal(shift, "(3,)", &[0.0; 3]), "array scaling_layer.shift in the weights has the shape [3]"),
            (
                refusal(shift, "(1, 3, 1, 1)", &[f32::NAN; 3]),
                "array scaling_layer.shift in the weights has values",
            ),
            (refusal(shift, "(1, 3, 1, 1)", &[0.0; 2]), "array scaling_layer.shift in the weights is not"),
            (refusal(shift, "(9999,)", &[0.0; 9999]), "array scaling_layer.shift in the weights is not"),
            (refusal(shift, "(1, 3, 1, 1)", &[0.0; 3]), "no array scaling_layer.scale "),
        ];
        for (refusal, expected) in cases {
            assert!(refusal.contains(expected), "{refusal}");
        }
    }

    #[test]
    fn what_is_no_archive_is_refused() {
        assert!(matches!(read_archive(tempfile::tempfile().unwrap()), Err(WeightsError::Archive(_))));
        assert!(matches!(read(Path::new("no/such/file")), Err(WeightsError::Io(_))));
    }
}
