//! Sums over directions that are integrals over the sphere.

use glam::DVec3;

/// Directions and weights whose sum is the integral over the sphere of any polynomial of degree 9 or less: the corners of
/// an icosahedron and of the dodecahedron around it.
/// Source: McLaren, "Optimal numerical integration on a sphere", 1963.
pub(crate) fn directions() -> impl Iterator<Item = (DVec3, f64)> {
    const AREA: f64 = 4.0 * std::f64::consts::PI;
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let signs = [1.0, -1.0];
    let pairs = move || signs.into_iter().flat_map(move |a| signs.into_iter().map(move |b| (a, b)));
    let cyclic = |a: f64, b: f64| [DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)];
    let icosahedron = pairs().flat_map(move |(a, b)| cyclic(a, b * golden));
    let rectangles = pairs().flat_map(move |(a, b)| cyclic(a * golden, b / golden));
    let cube = pairs().flat_map(move |(a, b)| signs.map(|c| DVec3::new(a, b, c)));
    let weighted = |direction: DVec3, weight: f64| (direction / direction.length(), weight * AREA);
    let icosahedron = icosahedron.map(move |direction| weighted(direction, 5.0 / 168.0));
    icosahedron.chain(rectangles.chain(cube).map(move |direction| weighted(direction, 27.0 / 840.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_the_sphere() {
        let (count, sum) = directions().fold((0, 0.0), |(count, sum), (_, weight)| (count + 1, sum + weight));
        assert_eq!(count, 32);
        assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    }
}
