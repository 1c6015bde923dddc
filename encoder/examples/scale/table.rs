//! The table of what scenes of growing size cost, and where that grows faster than the scene.

/// What grows from row to row, and how cost may grow with it, as a power of it, before it is said.
pub(crate) struct Growth {
    size: &'static str,
    time: f64,
    memory: f64,
}

impl Growth {
    /// Of one frame. A little more than linear is what caches and sorting take.
    pub(crate) const GAUSSIANS: Self = Self { size: "Gaussians", time: 1.1, memory: 1.1 };
    /// Of a sequence, of which only some frames are ever held.
    pub(crate) const FRAMES: Self = Self { size: "frames", time: 1.1, memory: 0.1 };
}

/// What some work on a scene cost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cost {
    /// Gaussians of all frames.
    pub(crate) gaussians: u64,
    /// Processor seconds of all threads.
    pub(crate) processor: f64,
    /// Most bytes in use at a time, besides those of before.
    pub(crate) peak: usize,
}

impl Cost {
    /// Nanoseconds of processor time per Gaussian.
    fn nanoseconds(&self) -> f64 {
        self.processor * 1e9 / self.gaussians as f64
    }

    fn peak_megabytes(&self) -> f64 {
        self.peak as f64 / 1e6
    }
}

/// What a scene costs.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// Gaussians or frames.
    pub(crate) size: u32,
    /// The balanced stream.
    pub(crate) bytes: usize,
    /// Encoding with the fast preset.
    pub(crate) fast: Cost,
    /// The same with the balanced preset.
    pub(crate) balanced: Cost,
    /// Decoding the balanced stream to planes of f32, digests compared.
    pub(crate) decode: Cost,
}

/// Prints the head of the table, in Markdown.
pub(crate) fn print_head(growth: &Growth) {
    println!("| {} | bits per Gaussian | fast: ns | MB | balanced: ns | MB | decode: ns | MB |", growth.size);
    println!("|--:|--:|--:|--:|--:|--:|--:|--:|");
}

impl Row {
    /// Prints a line of the table.
    pub(crate) fn print(&self) {
        let bits = 8.0 * self.bytes as f64 / self.balanced.gaussians as f64;
        let costs = [self.fast, self.balanced, self.decode];
        let costs = costs.map(|cost| format!("{:.0} | {:.1}", cost.nanoseconds(), cost.peak_megabytes()));
        println!("| {} | {bits:.1} | {} |", self.size, costs.join(" | "));
    }
}

/// Prints what grows more than it may in rows of growing size.
pub(crate) fn print_excesses(growth: &Growth, rows: &[Row]) {
    println!();
    let found = excesses(growth, rows);
    found.iter().for_each(|line| println!("{line}"));
    if found.is_empty() {
        println!("Nothing grows more than it may.");
    }
    println!();
}

/// What grows more than it may from one row to the next, a line each.
fn excesses(growth: &Growth, rows: &[Row]) -> Vec<String> {
    type Figure = fn(&Row) -> f64;
    let figures: [(&str, f64, Figure); 6] = [
        ("time of fast encoding", growth.time, |row| row.fast.processor),
        ("memory of fast encoding", growth.memory, |row| row.fast.peak as f64),
        ("time of balanced encoding", growth.time, |row| row.balanced.processor),
        ("memory of balanced encoding", growth.memory, |row| row.balanced.peak as f64),
        ("time of decoding", growth.time, |row| row.decode.processor),
        ("memory of decoding", growth.memory, |row| row.decode.peak as f64),
    ];
    let mut lines = Vec::new();
    // A frame alone is another kind of stream.
    let rows = rows.iter().filter(|row| row.size > 1);
    for (row, next) in rows.clone().zip(rows.skip(1)) {
        let sizes = f64::from(next.size) / f64::from(row.size);
        for (name, power, figure) in figures {
            let times = figure(next) / figure(row);
            if times > sizes.powf(power) {
                let (from, to, size) = (row.size, next.size, growth.size);
                lines.push(format!("Grows too much: {name}, {times:.1} times from {from} to {to} {size}."));
            }
        }
    }
    lines
}
