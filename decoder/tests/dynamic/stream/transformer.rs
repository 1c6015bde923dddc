//! Clause 7.17.6: the learned predictor, in the words of the specification.

use super::cells::isqrt;
use super::gaussian::{Rules, Splat, round};
use super::network::{FULL_ATTENTION, GATED, KNN_BASE, NORMALISED, Network};
use super::prediction::{EXP, Neighbour, bilateral, bilateral_weights, knn, mean, table};
use splatstream_format::entropy::layout::Attribute;
use splatstream_format::payload::Transform;
use std::sync::LazyLock;

/// The table of 7.17.7, read from the text.
pub(crate) static SINE: LazyLock<Vec<i64>> = LazyLock::new(|| table("### 7.17.7", "**[SS-TR-010]**"));

/// 7.17.7.
pub(crate) fn sine(x: i64) -> i64 {
    let r = x.rem_euclid(128) as usize;
    match x.rem_euclid(512) / 128 {
        0 => SINE[r],
        1 => SINE[128 - r],
        2 => -SINE[r],
        _ => -SINE[128 - r],
    }
}

/// `a / b` of 4.2, b > 0.
const fn floor(a: i64, b: i64) -> i64 {
    a.div_euclid(b)
}

/// `clamp(x, -127, 127)`.
fn small(x: i64) -> i64 {
    x.clamp(-127, 127)
}

fn act(x: i64, s: u8) -> i64 {
    small(round(x, s.into()))
}

/// `W[i] * x` for a row.
fn times(row: &[i64], x: &[i64]) -> i64 {
    assert_eq!(row.len(), x.len());
    row.iter().zip(x).map(|(w, x)| w * x).sum()
}

/// The mean of rows, place by place, rounded as SS-TR-004 and SS-TR-008 write it.
fn mean_row(rows: &[Vec<i64>]) -> Vec<i64> {
    let k = rows.len() as i64;
    (0..rows[0].len()).map(|i| floor(2 * rows.iter().map(|row| row[i]).sum::<i64>() + k, 2 * k)).collect()
}

/// Predictor 3: 7.17.3 or 7.17.4 up to the rotation, then 7.17.6; `own` is the new Gaussian as far as it is reconstructed.
pub(crate) fn learned(
    near: &[Neighbour<'_>],
    rules: &Rules<'_>,
    attribute: Attribute,
    own: &Splat,
) -> Vec<i64> {
    let network = rules.network.unwrap();
    match attribute {
        Attribute::Dc => Predicted { network, rules, near, own }.colours(0),
        Attribute::Sh => Predicted { network, rules, near, own }.colours(1),
        _ if network.is(KNN_BASE) => knn(near, attribute),
        _ => bilateral(near, rules.header, attribute, own),
    }
}

/// One new Gaussian that the network predicts.
struct Predicted<'a> {
    network: &'a Network,
    rules: &'a Rules<'a>,
    near: &'a [Neighbour<'a>],
    own: &'a Splat,
}

impl Predicted<'_> {
    /// `p.dc` (0) or `p.sh` (1).
    fn colours(&self, kind: usize) -> Vec<i64> {
        let header = &self.network.header;
        let weight = bilateral_weights(self.near, self.rules.header, Attribute::Dc, self.own);
        let base = [Attribute::Dc, Attribute::Sh].map(|attribute| match self.network.is(KNN_BASE) {
            true => knn(self.near, attribute),
            false => mean(&weight, self.near, attribute),
        });
        let near = self.geometry();
        let h = self.embedded(&self.tokens(&weight, &base), &near);
        let pool = if self.network.is(FULL_ATTENTION) {
            let rows: Vec<Vec<i64>> =
                (0..h.len()).map(|m| self.attended(&h[m], near[m], &h, &near)).collect();
            mean_row(&rows)
        } else {
            let query = self.network.row("query");
            let row: Vec<i64> = mean_row(&h).iter().zip(query).map(|(h, query)| small(h + query)).collect();
            self.attended(&row, [0; 3], &h, &near)
        };
        let heads = self.network.rows("head").iter().zip(self.network.row("head_bias"));
        let one = |(head, bias): (&Vec<i64>, &i64)| {
            let out = round(times(head, &pool) + bias, header.layer_shift[7].into());
            out.clamp(-1023, 1023) << header.output_shift
        };
        let out: Vec<i64> = heads.map(one).collect();
        let value = |(i, base): (usize, &i64)| {
            let term = |(k, out): (usize, &i64)| match self.component(k) {
                Some((of, basis)) if of == kind => i64::from(basis[i]) * out,
                _ => 0,
            };
            let sum: i64 = out.iter().enumerate().map(term).sum();
            (base + round(sum, 12)).clamp(-(1 << 30), 1 << 30)
        };
        base[kind].iter().enumerate().map(value).collect()
    }

    /// Kind and `basis` of the component of place k, unless the transform has none.
    fn component(&self, k: usize) -> Option<(usize, &[i16])> {
        let dc_count = usize::from(self.network.header.dc_count);
        let (kind, transform, c): (usize, Option<&Transform>, usize) = match k.checked_sub(dc_count) {
            None => (0, Some(self.rules.tools.dc), k),
            Some(c) => (1, self.rules.tools.sh, c),
        };
        let transform = transform?;
        let dimension = usize::from(transform.header.dimension);
        let holds = c < usize::from(transform.header.rank);
        holds.then(|| (kind, &transform.basis[c * dimension..(c + 1) * dimension]))
    }

    /// SS-TR-001.
    fn tokens(&self, weight: &[i64], base: &[Vec<i64>; 2]) -> Vec<Vec<i64>> {
        let header = &self.network.header;
        let last = self.near[self.near.len() - 1].d2;
        let one = |(neighbour, weight): (&Neighbour<'_>, &i64)| {
            let (theirs, own) = (neighbour.splat, self.own);
            let x = [Attribute::Dc, Attribute::Sh].map(|attribute| theirs.value(attribute));
            let component = |k: usize| {
                let Some((kind, basis)) = self.component(k) else { return 0 };
                let difference = x[kind].iter().zip(&base[kind]).map(|(x, base)| x - base);
                let sum = basis.iter().zip(difference).map(|(&basis, x)| i64::from(basis) * x).sum();
                act(sum, 12 + header.token_shift)
            };
            let mut token: Vec<i64> =
                (0..usize::from(header.dc_count + header.sh_count)).map(component).collect();
            token.extend([0, 1, 2].map(|k| small(4 * (theirs.q[k] - own.q[k]))));
            token.push(small(2 * (theirs.o - own.o)));
            token.extend([0, 1, 2].map(|k| small(theirs.rotation()[k] - own.rotation()[k])));
            token.push(floor(127 * neighbour.d2, last + 1));
            if self.network.is(GATED) {
                token.iter_mut().for_each(|value| *value = act(weight * *value, 12));
            }
            token
        };
        self.near.iter().zip(weight).map(one).collect()
    }

    /// SS-TR-002.
    fn geometry(&self) -> Vec<[i64; 3]> {
        let own = self.own.position();
        let offset = |neighbour: &Neighbour<'_>| {
            let theirs = neighbour.splat.position();
            [0, 1, 2].map(|a| theirs[a] - own[a])
        };
        let offsets: Vec<[i64; 3]> = self.near.iter().map(offset).collect();
        let reach = offsets.iter().flatten().map(|offset| offset.abs()).max().unwrap().max(1);
        offsets.iter().map(|offset| offset.map(|offset| floor(254 * offset + reach, 2 * reach))).collect()
    }

    /// SS-TR-003.
    fn embedded(&self, token: &[Vec<i64>], near: &[[i64; 3]]) -> Vec<Vec<i64>> {
        let (network, shift) = (self.network, self.network.header.layer_shift);
        let one = |(j, (token, near)): (usize, (&Vec<i64>, &[i64; 3]))| {
            let layer = network.rows("geometry").iter().zip(network.row("geometry_bias"));
            let hidden: Vec<i64> =
                layer.map(|(row, bias)| act(times(row, near) + bias, shift[0]).max(0)).collect();
            let ranks = network.rows("rank_embedding");
            let rank = &ranks[j.min(ranks.len() - 1)];
            let layer = network.rows("embedding").iter().zip(network.rows("geometry_embedding"));
            let sums = layer.map(|(of_token, of_place)| times(of_token, token) + times(of_place, &hidden));
            sums.zip(rank).map(|(sum, rank)| act(sum + rank, shift[1])).collect()
        };
        token.iter().zip(near).enumerate().map(one).collect()
    }

    /// SS-TR-005 to SS-TR-007: what a row becomes.
    fn attended(&self, row: &[i64], from: [i64; 3], h: &[Vec<i64>], near: &[[i64; 3]]) -> Vec<i64> {
        let (network, shift) = (self.network, self.network.header.layer_shift);
        let u: Vec<i64> =
            network.rows("attention").iter().map(|weights| act(times(weights, row), shift[2])).collect();
        let fourier = network.row("fourier");
        let logit = |(h, near): (&Vec<i64>, &[i64; 3])| {
            let mut sum = times(&u, h);
            for (k, fourier) in fourier.chunks(6).enumerate() {
                for a in 0..3 {
                    let phase = (near[a] - from[a]) << k;
                    sum += fourier[2 * a] * sine(phase) + fourier[2 * a + 1] * sine(phase + 128);
                }
            }
            round(sum, shift[3].into())
        };
        let logits: Vec<i64> = h.iter().zip(near).map(logit).collect();
        let largest = logits.iter().max().unwrap();
        let power: Vec<i64> = logits.iter().map(|logit| EXP[(largest - logit).min(255) as usize]).collect();
        let ratio = floor(1 << 26, power.iter().sum());
        let share: Vec<i64> = power.iter().map(|power| round(power * ratio, 18)).collect();
        let z: Vec<i64> = (0..row.len())
            .map(|i| act(share.iter().zip(h).map(|(share, h)| share * h[i]).sum(), 8))
            .collect();
        let layer = network.rows("value").iter().zip(network.row("value_bias")).zip(row);
        let x = layer.map(|((weights, bias), row)| small(row + act(times(weights, &z) + bias, shift[4])));
        self.fed_forward(self.normalised(x.collect()))
    }

    fn normalised(&self, x: Vec<i64>) -> Vec<i64> {
        if !self.network.is(NORMALISED) {
            return x;
        }
        let middle = round(x.iter().sum(), self.network.header.width_log2.into());
        let apart: Vec<i64> = x.iter().map(|x| x - middle).collect();
        let ratio = floor(1 << 16, isqrt(times(&apart, &apart)).max(1));
        let gains = self.network.row("gain").iter().zip(self.network.row("gain_bias"));
        let one = |(apart, (gain, bias)): (&i64, (&i64, &i64))| act(gain * round(apart * ratio, 8) + bias, 5);
        apart.iter().zip(gains).map(one).collect()
    }

    fn fed_forward(&self, x: Vec<i64>) -> Vec<i64> {
        let (network, shift) = (self.network, self.network.header.layer_shift);
        if network.header.feed_forward_width == 0 {
            return x;
        }
        let layer = network.rows("widening").iter().zip(network.row("widening_bias"));
        let wide: Vec<i64> =
            layer.map(|(weights, bias)| act(times(weights, &x) + bias, shift[5]).max(0)).collect();
        let layer = network.rows("narrowing").iter().zip(network.row("narrowing_bias")).zip(&x);
        layer.map(|((weights, bias), x)| small(x + act(times(weights, &wide) + bias, shift[6]))).collect()
    }
}
