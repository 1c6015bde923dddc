//! Model predictive control: the best sequence of choices for the next GOPs under a predicted throughput.

use super::number::real;
use super::options::Choice;

/// What the plan is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outlook {
    /// Predicted throughput in bits per second.
    pub(crate) throughput: f64,
    /// From a request to its first bytes, in seconds.
    pub(crate) latency: f64,
    /// Buffered seconds.
    pub(crate) buffer: f64,
    /// Largest buffer in seconds.
    pub(crate) full: f64,
    /// Quality of the GOP before, in dB.
    pub(crate) before: Option<f64>,
    /// What a second without picture costs, in dB·s.
    pub(crate) stall_weight: f64,
    /// What a change of quality by 1 dB costs, in dB·s.
    pub(crate) change_weight: f64,
    /// What a second of buffer is worth when it is full, in dB.
    pub(crate) price: f64,
    /// How many times as much more the first second is worth.
    pub(crate) fear: f64,
}

impl Outlook {
    /// Seconds to fetch so many bytes.
    pub(crate) fn time(&self, bytes: u64) -> f64 {
        if bytes == 0 { 0.0 } else { self.latency + real(bytes) * 8.0 / self.throughput.max(1.0) }
    }

    /// What a buffer is worth, in dB·s: its last second is worth the price if it is full, and the more the emptier it is, up
    /// to 1 + `fear` times the price.
    pub(crate) fn worth(&self, buffer: f64) -> f64 {
        let full = self.full.max(0.1);
        let missing = (1.0 - buffer / full).clamp(0.0, 1.0);
        let third = missing * missing * missing;
        self.price * (buffer - full * self.fear * third / 3.0)
    }
}

/// A GOP that a plan chooses for.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    /// Its number.
    pub(crate) gop: usize,
    /// What it can be chosen to have, from the cheapest on.
    pub(crate) choices: Vec<Choice>,
    /// Its duration in seconds.
    pub(crate) duration: f64,
}

impl Stage {
    /// A GOP with its choices and its duration in seconds.
    pub(crate) fn new(gop: usize, choices: Vec<Choice>, duration: f64) -> Self {
        Self { gop, choices, duration }
    }
}

/// Plans that are kept from GOP to GOP.
const WIDTH: usize = 48;

#[derive(Clone, Copy)]
struct Plan {
    first: usize,
    buffer: f64,
    before: Option<f64>,
    value: f64,
}

/// The index of the best choice for the first stage, and what the plan that begins with it is worth.
pub(crate) fn best(stages: &[Stage], outlook: &Outlook) -> (usize, f64) {
    let start = Plan { first: 0, buffer: outlook.buffer, before: outlook.before, value: 0.0 };
    let mut plans = vec![start];
    for (number, Stage { choices, duration, .. }) in stages.iter().enumerate() {
        let mut next = Vec::with_capacity(plans.len().saturating_mul(choices.len()));
        for plan in &plans {
            for (index, choice) in choices.iter().enumerate() {
                let first = if number == 0 { index } else { plan.first };
                next.push(Plan { first, ..after(plan, choice, *duration, outlook) });
            }
        }
        let total = |plan: &Plan| plan.value + outlook.worth(plan.buffer);
        // Among equals the cheaper first choice comes first, as the sort is stable.
        next.sort_by(|a, b| total(b).total_cmp(&total(a)));
        next.truncate(WIDTH);
        plans = next;
    }
    plans.first().map_or((0, 0.0), |plan| (plan.first, plan.value + outlook.worth(plan.buffer)))
}

/// A plan with one more choice.
fn after(plan: &Plan, choice: &Choice, duration: f64, outlook: &Outlook) -> Plan {
    let time = outlook.time(choice.bytes);
    let stall = (time - plan.buffer).max(0.0);
    let change = plan.before.map_or(0.0, |before| (choice.quality - before).abs());
    let value = choice.quality * duration - outlook.change_weight * change - outlook.stall_weight * stall;
    // What does not fit is waited for.
    let buffer = ((plan.buffer - time).max(0.0) + duration).min(outlook.full);
    Plan { first: plan.first, buffer, before: Some(choice.quality), value: plan.value + value }
}
