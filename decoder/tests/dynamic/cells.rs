//! 7.15: cells at the corners of the lattice, turns of every size, and the unit of rotations.

use crate::crafted::expect::{decode, planes};
use crate::stream::cells::{Cell, unit as rotation_unit};
use crate::stream::draw::morton;
use crate::stream::expect::assert_decodes;
use crate::stream::sample::{frame, gop, placed, unit};
use crate::stream::scene::{Scene, Unit};

/// The corners of a lattice of 10 bits, and places inside it.
const PLACES: [[i64; 3]; 8] =
    [[0, 0, 0], [3, 3, 3], [4, 3, 3], [700, 0, 0], [0, 1023, 0], [500, 511, 300], [512, 511, 512], [1023; 3]];

/// Gaussians at places, which a frame displaces by cells of a size; all are kept.
fn displaced(places: &[[i64; 3]], cell_log2: u8, cells: Vec<Cell>) -> Scene {
    let mut places = places.to_vec();
    places.sort_by_key(|&place| morton(place, 20));
    let intra = Unit { new: placed(&places), ..Unit::default() };
    let mut moved = Unit { cells, modes: vec![0; places.len()], ..Unit::default() };
    moved.header.cell_log2 = cell_log2;
    gop(&[100], vec![frame(0, vec![intra]), frame(1, vec![moved])])
}

/// The cells in which the places lie, all with one motion.
fn around(places: &[[i64; 3]], cell_log2: u8, motion: Cell) -> Vec<Cell> {
    cells_of(10, places, cell_log2, motion)
}

fn cells_of(position_bits: u8, places: &[[i64; 3]], cell_log2: u8, motion: Cell) -> Vec<Cell> {
    let bits = position_bits.saturating_sub(cell_log2).max(1);
    let code = |place: &[i64; 3]| morton(place.map(|x| x >> cell_log2), bits);
    let mut codes: Vec<u64> = places.iter().map(code).collect();
    codes.sort_unstable();
    codes.dedup();
    codes.into_iter().map(|code| Cell { code, ..motion }).collect()
}

/// The positions of the last frame.
fn positions(scene: &Scene) -> Vec<[i32; 3]> {
    let planes = planes(&decode(&scene.bytes()).frames.last().unwrap().planes);
    (0..planes[0].len()).map(|place| [0, 1, 2].map(|axis| planes[axis][place])).collect()
}

// covers: SS-MO-004, SS-MO-001, SS-MO-002
#[test]
fn cells_of_every_size_turn_and_shift_as_the_reference_does() {
    let turns = [[0; 3], [1, 0, 0], [8192; 3], [-8192, 8192, -8192], [8191, -3, 77], [0, 0, 8192]];
    let shifts = [[0; 3], [1, -1, 4], [-65_535, 65_535, 20_000], [7, 8, 9]];
    for cell_log2 in 0..=10 {
        for (turn, translation) in
            turns.iter().flat_map(|turn| shifts.iter().map(move |shift| (*turn, *shift)))
        {
            let cells = around(&PLACES, cell_log2, Cell { translation, turn, ..Cell::default() });
            assert_decodes(
                &format!("{cell_log2} {turn:?} {translation:?}"),
                &displaced(&PLACES, cell_log2, cells),
            );
        }
    }
}

// covers: SS-MO-001, SS-MO-004
#[test]
fn lattices_of_one_bit_and_of_twenty_have_cells_too() {
    for (bits, sizes) in [(1_u8, vec![0, 1]), (20, vec![0, 1, 9, 19, 20])] {
        let places = PLACES.map(|place| place.map(|x| if bits == 1 { x & 1 } else { x * 1024 + x }));
        for cell_log2 in sizes {
            let motion = Cell { turn: [-700, 8192, 41], translation: [30_000, -3, 5], ..Cell::default() };
            let mut scene = displaced(&places, cell_log2, cells_of(bits, &places, cell_log2, motion));
            scene.sequence.position_bits = bits;
            assert_decodes(&format!("{bits} {cell_log2}"), &scene);
        }
    }
}

// covers: SS-MO-002
#[test]
fn what_would_leave_the_lattice_stays_at_its_edge() {
    let motion = Cell { translation: [-65_535, 65_535, 0], ..Cell::default() };
    let scene = displaced(&PLACES, 10, around(&PLACES, 10, motion));
    assert!(positions(&scene).iter().all(|[x, y, _]| (*x, *y) == (0, 1023)));
    // Eighths of a step: halves go up.
    let motion = Cell { translation: [4, -4, 3], ..Cell::default() };
    let scene = displaced(&[[10, 20, 30]], 3, around(&[[10, 20, 30]], 3, motion));
    assert_eq!(positions(&scene), [[11, 20, 30]]);
}

// covers: SS-MO-004
#[test]
fn a_third_of_a_turn_about_the_diagonal_exchanges_the_axes_of_all_components_at_once() {
    // The middle of the cell of side 16 is 8, 8, 8.
    let motion = Cell { turn: [8192; 3], ..Cell::default() };
    let scene = displaced(&[[10, 12, 3], [8, 8, 8]], 4, around(&[[0; 3]], 4, motion));
    assert_decodes("a third of a turn", &scene);
    assert_eq!(positions(&scene), [[3, 10, 12], [8, 8, 8]]);
}

// covers: SS-MO-003
#[test]
fn the_unit_of_rotations_follows_from_the_exact_step() {
    let steps: [(f32, i64); 9] = [
        (1.0, 1),
        (0.4, 2),
        (0.4_f32.next_down(), 3),
        (0.01, 100),
        (0.007_812_5, 128),
        (1.0 / 32_766.0, 32_766),
        (1.0 / 32_768.0, 32_767),
        (1e-9, 32_767),
        (f32::from_bits(0x2B80_0000), 32_767),
    ];
    for (step, expected) in steps {
        assert_eq!(rotation_unit(step.to_bits()), expected, "{step}");
        for turn in [[8192, 0, 0], [-5000, 8000, 3], [0, 0, -8192]] {
            let mut scene = displaced(&PLACES, 9, around(&PLACES, 9, Cell { turn, ..Cell::default() }));
            scene.sequence.rotation_step = step.to_bits();
            // Long and short quaternions, of both signs.
            for (new, size) in
                scene.gops[0].frames[0].units[0].new.iter_mut().zip([0, 1, 40, 99, -101, 4000, -4095, 7])
            {
                new.rotation = [size, -size / 2, size / 3];
            }
            assert_decodes(&format!("{step} {turn:?}"), &scene);
        }
    }
}

// covers: SS-CA-001, SS-CA-002
#[test]
fn what_is_carried_follows_the_cells_and_leaves_out_the_stale_ones() {
    // A home of one at 0, 0, 0; one of three in other cells of side 512.
    let carried = [[600, 0, 0], [0, 600, 0], [600, 600, 600]];
    let first = Unit { new: placed(&[[0; 3]]), ..Unit::default() };
    let second = Unit { refinement: 1, new: placed(&carried), ..Unit::default() };
    let still = |place| {
        let units = vec![Unit { modes: vec![0], ..Unit::default() }];
        crate::stream::scene::Frame { count: Some(1), ..frame(place, units) }
    };
    let mut scene = gop(&[25, 100], vec![frame(0, vec![first, second]), still(1), still(2), still(3)]);
    let cell = |code, stale| Cell { code, stale, translation: [8, 0, 0], ..Cell::default() };
    // Frame 1 moves what is at x 600, frame 2 takes out what is at 600, 600, 600, frame 3 what was at y 600.
    unit(&mut scene).cells = vec![cell(1, 0), cell(7, 0)];
    scene.gops[0].frames[2].units[0].cells = vec![cell(7, 1)];
    scene.gops[0].frames[3].units[0].cells = vec![cell(1, 0), cell(2, 1)];
    for frame in &mut scene.gops[0].frames[1..] {
        frame.units[0].header.cell_log2 = 9;
    }
    assert_decodes("stale cells", &scene);
    let shown: Vec<usize> = decode(&scene.bytes()).frames.iter().map(|frame| frame.carried).collect();
    assert_eq!(shown, [0, 3, 2, 1]);
    assert_eq!(positions(&scene), [[0, 0, 0], [602, 0, 0]]);
}
