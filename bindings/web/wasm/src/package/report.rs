//! What is known of the playback of a package, in numbers.

use super::Package;
use splatstream_stream::control::{Gop, OperatingPoint, Shown, State};
use splatstream_stream::playback::GopLog;

impl Package {
    /// What is known of playback, in numbers: 1 while it waits, the GOP, seconds that are buffered, bits a second that the
    /// network carries (0 if that is not known) and its latency in seconds, stalls, seconds of these, seconds until the first
    /// picture; bytes, requests, failures and abandoned fetches; of the GOP that is shown its operating point (spatial,
    /// temporal or -1, refinement), its quality in dB and its bits a second; the frame up to which it is buffered; 1 while it
    /// grows, the first frame that can be shown, the one after the last, the one that playback near the end starts with, 1 if
    /// playback stays behind, how long ago in seconds what is shown was captured (-1 if it does not grow), and the pace of
    /// playback.
    pub fn report(&self, numbers: &mut Vec<f64>) {
        let state = self.player.state();
        let seconds = |us: u64| us as f64 / 1e6;
        let sum = |of: fn(&GopLog) -> u64| self.sum(of) as f64;
        let network = state.network();
        numbers.extend([
            f64::from(u8::from(!self.gop.is_open && !self.is_ended)),
            state.current() as f64,
            seconds(state.buffer_us()),
            network.mean(5.0).unwrap_or_default(),
            network.latency(),
            f64::from(self.stalls.0),
            seconds(self.stalls.1),
        ]);
        numbers.extend([
            sum(|log| log.bytes),
            sum(|log| log.requests),
            sum(|log| log.failures),
            sum(|log| log.abandoned),
        ]);
        self.report_shown(state, numbers);
        numbers.push(self.first_frame(state.first_missing()).into());
        self.report_growth(numbers);
    }

    fn report_growth(&self, numbers: &mut Vec<f64>) {
        let player = &self.player;
        let end = self.first_frame(usize::MAX);
        let edge = player.edge().map_or(end, |gop| self.first_frame(gop));
        let latency_us = player.state().latency_us().filter(|_| player.is_following());
        numbers.push(f64::from(u8::from(player.is_following())));
        numbers.extend([self.first_frame(player.first_kept()), end, edge].map(f64::from));
        numbers.push(f64::from(u8::from(player.is_behind())));
        numbers.push(latency_us.map_or(-1.0, |us| us as f64 / 1e6));
        numbers.push(f64::from(player.pace_milli()) / 1000.0);
    }

    fn report_shown(&self, state: &State, numbers: &mut Vec<f64>) {
        let shown = state.shown().last();
        let temporal = |point: OperatingPoint| point.temporal.map_or(-1.0, f64::from);
        let rate = |shown: &Shown| {
            let duration_us = state.ladder().gops().get(shown.gop).map_or(1, Gop::duration_us);
            shown.bytes as f64 * 8e6 / duration_us.max(1) as f64
        };
        numbers.extend(shown.map_or([-1.0; 5], |shown| {
            let point = shown.point;
            [
                f64::from(point.spatial),
                temporal(point),
                f64::from(point.refinement),
                shown.quality,
                rate(shown),
            ]
        }));
    }
}
