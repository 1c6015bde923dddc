//! Weights that are accepted: small networks, and the names of registered ones.

use super::coded::Values;
use crate::payload::{Layer, Network, Part, REGISTRY, Weights};
use crate::syntax::NetworkHeader;
use arbitrary::{Error, Result, Unstructured};

/// Any small network, or one that is registered.
///
/// # Errors
/// There are too few bytes.
pub fn weights(u: &mut Unstructured<'_>) -> Result<Weights> {
    let index: usize = u.int_in_range(0..=3)?;
    match REGISTRY.get(index) {
        Some((digest, _)) => Ok(Weights::Registered(*digest)),
        None => network(u).map(Box::new).map(Weights::Carried),
    }
}

fn network(u: &mut Unstructured<'_>) -> Result<Network> {
    let header = header(u)?;
    let mut values = Values::new(u.arbitrary()?);
    // Sums as large as can be, or as they come.
    let at_ends = u.ratio(1_u8, 4_u8)?;
    let mut number = |least: i32, most: i32| match (at_ends, values.between(0, 1)) {
        (false, _) => values.between(least, most),
        (true, 0) => least,
        (true, _) => most,
    };
    let layers = Part::ALL.map(|part| {
        let (weights, biases) = part.lengths(&header);
        let weight = |_| i8::try_from(number(i8::MIN.into(), i8::MAX.into())).unwrap_or(0);
        let weights = (0..weights).map(weight).collect();
        let bias = |_| i16::try_from(number(i16::MIN.into(), i16::MAX.into())).unwrap_or(0);
        Layer { weights, bias: (0..biases).map(bias).collect() }
    });
    Network::new(header, layers).map_err(|_| Error::IncorrectFormat)
}

/// Mostly narrow: what is wide takes long.
fn header(u: &mut Unstructured<'_>) -> Result<NetworkHeader> {
    let is_wide = u.ratio(1_u8, 16_u8)?;
    let [width_log2, feed_forward, geometry] = if is_wide { [6, 128, 32] } else { [4, 16, 8] };
    let mut layer_shift = [0; 8];
    for shift in &mut layer_shift {
        *shift = u.int_in_range(1..=15)?;
    }
    let dc_count: u8 = u.int_in_range(0..=3)?;
    Ok(NetworkHeader {
        network_flags: u.int_in_range(0..=15)?,
        width_log2: u.int_in_range(3..=width_log2)?,
        feed_forward_width: u.int_in_range(0..=feed_forward)?,
        geometry_width: u.int_in_range(0..=geometry)?,
        fourier_count: u.int_in_range(0..=4)?,
        rank_count: u.int_in_range(1..=16)?,
        dc_count,
        sh_count: u.int_in_range(u8::from(dc_count == 0)..=16)?,
        token_shift: u.int_in_range(0..=8)?,
        output_shift: u.int_in_range(0..=4)?,
        layer_shift,
    })
}
