//! The transfer function as shaders read it: a table with what interpolation needs of each point, and, for values in bins of
//! equal size, the few points among which a shader has to search. So a search takes as long for hundreds of points as
//! for two. (That matters where a CPU's driver counts the iterations of loops: loop.glsl.)

use super::medium::{Medium, TransferPoint};
use crate::render::shared::{
    TRANSFER_BINS, TRANSFER_CANDIDATES, TRANSFER_COLORS, TRANSFER_INTEGRALS, TRANSFER_SEGMENTS,
};

/// Rows of the transfer function's image.
const ROWS: usize = 4;

/// Columns and rows of the image of a transfer function with so many points.
pub fn transfer_extent(points: usize) -> [u32; 2] {
    [(points as u32 + 1).max(TRANSFER_BINS), ROWS as u32]
}

impl Medium {
    /// The texels of the transfer function's image, row after row; none in vacuum. The first row has a column for each point,
    /// of which the last stands twice: value, 1 / (distance to the next value), opacity and the next point's opacity. The
    /// second row has the colours and, in its last component, the integral of opacity over values from the middle point to
    /// this one; the third row has the integral of opacity times colour. The fourth has a column for each bin of values:
    /// the first point that a value in it may be interpolated from, and how many there are.
    pub fn transfer_texels(&self) -> Vec<[f32; 4]> {
        if self.transfer.is_empty() {
            return Vec::new();
        }
        let [width, _] = transfer_extent(self.transfer.len());
        let integrals = self.opacity_integrals();
        let mut rows = [const { Vec::new() }; ROWS];
        rows[TRANSFER_SEGMENTS as usize] = self.shares();
        rows[TRANSFER_COLORS as usize] = self.colors(&integrals);
        rows[TRANSFER_INTEGRALS as usize] = colored_integrals(&integrals);
        rows[TRANSFER_CANDIDATES as usize] = self.candidates();
        let padded = rows.map(|mut row| {
            row.resize(width as usize, [0.0; 4]);
            row
        });
        padded.concat()
    }

    /// The value at which bins begin, and how many there are in a unit of stored values.
    pub fn bins(&self) -> [f32; 2] {
        let (Some(first), Some(last)) = (self.transfer.first(), self.transfer.last()) else {
            return [0.0; 2];
        };
        let per_value = TRANSFER_BINS as f32 / (last.value - first.value);
        [
            first.value,
            if per_value.is_finite() {
                per_value
            } else {
                0.0
            },
        ]
    }

    /// All points, and the last once more.
    fn columns(&self) -> impl Iterator<Item = &TransferPoint> {
        self.transfer.iter().chain(self.transfer.last())
    }

    fn shares(&self) -> Vec<[f32; 4]> {
        let next = self.columns().skip(1).chain(self.transfer.last());
        let shares = self.columns().zip(next).map(|(point, next)| {
            let distance = next.value - point.value;
            let per_value = if distance > 0.0 { 1.0 / distance } else { 0.0 };
            [point.value, per_value, point.opacity, next.opacity]
        });
        shares.collect()
    }

    fn colors(&self, integrals: &[[f64; 4]]) -> Vec<[f32; 4]> {
        let colors = self.columns().zip(integrals).map(|(point, integral)| {
            let [r, g, b] = point.color;
            [r, g, b, integral[3] as f32]
        });
        colors.collect()
    }

    /// Half a bin on either side is added to each, since a shader's arithmetic rounds.
    fn candidates(&self) -> Vec<[f32; 4]> {
        let [begin, per_value] = self.bins().map(f64::from);
        let segments = self.segments() as usize;
        // The last point from which a value is interpolated, as `transfer_point` in medium.glsl finds it.
        let point_at = |value: f64| {
            let not_above = self
                .transfer
                .partition_point(|p| f64::from(p.value) <= value);
            not_above.saturating_sub(1).min(segments - 1)
        };
        let candidates = (0..TRANSFER_BINS).map(|bin| {
            let edge = |bins: f64| begin + bins / per_value;
            let first = match bin {
                0 => 0,
                _ => point_at(edge(f64::from(bin) - 0.5)),
            };
            let last = match bin + 1 {
                TRANSFER_BINS => segments - 1,
                next => point_at(edge(f64::from(next) + 0.5)),
            };
            [first as f32, (last - first + 1) as f32, 0.0, 0.0]
        });
        if per_value > 0.0 {
            candidates.collect()
        } else {
            // All points are at one value.
            vec![[0.0, segments as f32, 0.0, 0.0]; TRANSFER_BINS as usize]
        }
    }

    /// ∫ opacity · colour and, last, ∫ opacity over values from the middle one of all points to each point, of which the last
    /// stands twice. Differences between integrals have the most digits where these are small: that is where points are close
    /// together, even if the data go on far beyond, as where a number stands for missing values.
    fn opacity_integrals(&self) -> Vec<[f64; 4]> {
        let mut sum = [0.0; 4];
        let mut integrals: Vec<[f64; 4]> = self.transfer.first().map(|_| sum).into_iter().collect();
        for pair in self.transfer.windows(2) {
            let distance = f64::from(pair[1].value) - f64::from(pair[0].value);
            let [a, b] = [0, 1].map(|i| f64::from(pair[i].opacity));
            let colored = |c: usize| {
                let [x, y] = [0, 1].map(|i| f64::from(pair[i].color[c]));
                (a * (2.0 * x + y) + b * (x + 2.0 * y)) / 6.0
            };
            let means = [colored(0), colored(1), colored(2), (a + b) / 2.0];
            sum = std::array::from_fn(|i| sum[i] + distance * means[i]);
            integrals.push(sum);
        }
        integrals.extend(integrals.last().copied());
        let middle = self.transfer.len() / 2;
        let origin = integrals.get(middle).copied().unwrap_or(sum);
        let from_middle = |integral: [f64; 4]| std::array::from_fn(|i| integral[i] - origin[i]);
        integrals.into_iter().map(from_middle).collect()
    }
}

fn colored_integrals(integrals: &[[f64; 4]]) -> Vec<[f32; 4]> {
    let integrals = integrals.iter();
    let colored = integrals.map(|i| [i[0] as f32, i[1] as f32, i[2] as f32, 0.0]);
    colored.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(values: &[f32]) -> Medium {
        let point = |&value: &f32| TransferPoint {
            value,
            opacity: 0.5,
            color: [0.9; 3],
        };
        Medium {
            density: 1.0,
            g: 0.0,
            transfer: values.iter().map(point).collect(),
            linear_opacity: None,
            block_size: 8,
        }
    }

    /// The search of a shader, whose bin may be the next one to that of exact arithmetic.
    #[test]
    fn a_search_among_the_candidates_of_a_bin_finds_what_one_among_all_finds() {
        let dense: Vec<f32> = (0..256).map(|n| 40.0 + n as f32).collect();
        let crowded: Vec<f32> = (0..90)
            .map(|n| 7.0 + 1e-4 * n as f32)
            .chain([255.0])
            .collect();
        for values in [
            &[3.0][..],
            &[5.0, 5.0],
            &[0.0, 1.0, 1.0, 9.0, 9.0],
            &dense,
            &crowded,
        ] {
            let medium = medium(values);
            let candidates = medium.candidates();
            let segments = medium.segments() as usize;
            let [begin, per_value] = medium.bins();
            let steps = values.iter().flat_map(|v| [v - 0.3, *v, v + 1e-5, v + 0.4]);
            for v in steps.chain([-1e9, 1e9]) {
                let below = values[..segments]
                    .iter()
                    .filter(|&&point| point <= v)
                    .count();
                let exact = below.saturating_sub(1);
                let exact_bin = (v - begin) * per_value;
                for bin in [exact_bin - 0.4, exact_bin, exact_bin + 0.4] {
                    let bin = bin.clamp(0.0, TRANSFER_BINS as f32 - 1.0) as usize;
                    let [first, count, ..] = candidates[bin].map(|x| x as usize);
                    assert!(
                        (first..first + count).contains(&exact),
                        "{v} in bin {bin}: {first}, {count}"
                    );
                }
            }
            let most = candidates.iter().map(|c| c[1] as usize).max();
            println!("{} points: {most:?} in a bin at most", values.len());
        }
        let in_a_bin = |c: &[f32; 4]| c[1] <= 3.0;
        assert!(medium(&dense).candidates().iter().all(in_a_bin));
    }
}
