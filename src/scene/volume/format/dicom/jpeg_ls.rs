//! JPEG-LS, lossless and near-lossless, of one component: ITU-T T.87, whose names are used here.
//!
//! Only decoders in C++ were available. Each pixel is predicted from its neighbours a (left), b (above), c (above
//! left) and d (above right), and the error is written in a Golomb code whose parameter is learnt for each of 365
//! kinds of neighbourhoods. Where all four are the same, the length of the run is written instead.

use crate::scene::volume::parsed::Parsed;

use super::golomb::Bits;

/// Bits of the coded length of a run, by the run index, which grows with each step of a run.
const J: [u32; 32] = [
    0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 9, 10, 11, 12, 13,
    14, 15,
];

const FRAME: u8 = 0xf7;
const PARAMETERS: u8 = 0xf8;
const SCAN: u8 = 0xda;
const RESTART_INTERVAL: u8 = 0xdd;

/// The parameters of a codestream.
#[derive(Debug, Clone, Copy)]
pub struct Header {
    pub width: u32,
    pub height: u32,
    /// Bits a pixel, from 2 to 16.
    pub precision: u32,
    near: i32,
    max: i32,
    thresholds: [i32; 3],
    reset: i32,
    /// Offset of the pixels.
    begin: usize,
}

impl Header {
    pub fn parse(bytes: &[u8]) -> Parsed<Header> {
        let ends = || "its codestream ends before its pixels".to_string();
        let word = |at: usize| match bytes.get(at..at + 2) {
            Some(pair) => Ok(i32::from(u16::from_be_bytes([pair[0], pair[1]]))),
            None => Err(ends()),
        };
        let byte = |at: usize| bytes.get(at).copied().ok_or_else(ends);
        let mut frame = None;
        let mut given = [0; 5];
        let mut at = 2;
        loop {
            if byte(at)? != 0xff {
                return Err(format!("byte {at} of its codestream is no marker"));
            }
            let (marker, length) = (byte(at + 1)?, word(at + 2)? as usize);
            let begin = at + 4;
            match marker {
                FRAME if byte(begin + 5)? == 1 => {
                    let (height, width) = (word(begin + 1)?, word(begin + 3)?);
                    frame = Some((u32::from(byte(begin)?), width as u32, height as u32));
                }
                FRAME => return Err("its pixels have several components, expected 1".into()),
                PARAMETERS if byte(begin)? == 1 => {
                    for (n, number) in given.iter_mut().enumerate() {
                        *number = word(begin + 1 + 2 * n)?;
                    }
                }
                PARAMETERS => return Err("its codestream maps values through a table".into()),
                RESTART_INTERVAL => return Err("its codestream has restart intervals".into()),
                SCAN => {
                    let (precision, width, height) =
                        frame.ok_or("its codestream has no frame header")?;
                    let near = i32::from(byte(begin + 3)?);
                    let header = Header {
                        width,
                        height,
                        precision,
                        near,
                        max: 0,
                        thresholds: [0; 3],
                        reset: 0,
                        begin: at + 2 + length,
                    };
                    return header.completed(given);
                }
                _ => {}
            }
            at += 2 + length.max(2);
        }
    }

    /// The header with the given parameters; for 0, with the standard's defaults.
    fn completed(mut self, [max, t1, t2, t3, reset]: [i32; 5]) -> Parsed<Header> {
        if !(2..=16).contains(&self.precision) {
            return Err(format!(
                "its pixels have {} bits, expected 2 to 16",
                self.precision
            ));
        }
        let most = (1 << self.precision) - 1;
        self.max = if max == 0 { most } else { max };
        self.reset = if reset == 0 { 64 } else { reset };
        if self.max > most || self.near > self.max / 2 || self.near > 255 || self.reset < 3 {
            return Err(
                "its codestream has preset parameters outside the range that the standard allows"
                    .into(),
            );
        }
        let near = self.near;
        let bounded = |value: i32, low: i32| {
            if value > self.max || value < low {
                low
            } else {
                value
            }
        };
        let basic = if self.max >= 128 {
            let factor = (self.max.min(4095) + 128) / 256;
            [
                factor + 2 + 3 * near,
                factor * 4 + 3 + 5 * near,
                factor * 17 + 4 + 7 * near,
            ]
        } else {
            let factor = 256 / (self.max + 1);
            [
                (3 / factor + 3 * near).max(2),
                (7 / factor + 5 * near).max(3),
                (21 / factor + 7 * near).max(4),
            ]
        };
        let first = bounded(basic[0], near + 1);
        let second = bounded(basic[1], first);
        let third = bounded(basic[2], second);
        let chosen = |given: i32, standard: i32| if given == 0 { standard } else { given };
        self.thresholds = [chosen(t1, first), chosen(t2, second), chosen(t3, third)];
        Ok(self)
    }
}

/// All pixels, row by row.
pub fn decode(bytes: &[u8], header: &Header) -> Parsed<Vec<u16>> {
    let (width, height) = (header.width as usize, header.height as usize);
    let mut pixels = vec![0; width * height];
    // A row with the values beside it: the pixel before the first, and the one after the last.
    let mut above = vec![0; width + 2];
    let mut row = vec![0; width + 2];
    let mut decoder = Decoder::new(header, bytes.get(header.begin..).unwrap_or_default());
    for line in pixels.chunks_exact_mut(width) {
        above[width + 1] = above[width];
        row[0] = above[1];
        decoder.row(&above, &mut row);
        if decoder.bits.is_exhausted() {
            return Err("its codestream ends before all pixels are there".into());
        }
        for (pixel, value) in line.iter_mut().zip(&row[1..]) {
            *pixel = *value as u16;
        }
        std::mem::swap(&mut above, &mut row);
    }
    Ok(pixels)
}

/// The state that is learnt for one kind of neighbourhood: the sum of the errors' sizes, the sum of the errors, their
/// number, and the correction that follows.
#[derive(Debug, Clone, Copy)]
struct Context {
    a: i32,
    b: i32,
    n: i32,
    c: i32,
}

struct Decoder<'a> {
    header: Header,
    range: i32,
    /// Bits of an error that is written directly.
    qbpp: u32,
    /// The longest code.
    limit: u32,
    contexts: Vec<Context>,
    /// The contexts for the ends of runs; `b` counts negative errors.
    ends: [Context; 2],
    run_index: usize,
    bits: Bits<'a>,
}

impl<'a> Decoder<'a> {
    fn new(header: &Header, bytes: &'a [u8]) -> Decoder<'a> {
        let bits_of = |count: i32| 32 - (count - 1).leading_zeros();
        let range = (header.max + 2 * header.near) / (2 * header.near + 1) + 1;
        let bpp = bits_of(header.max + 1).max(2);
        let context = Context {
            a: ((range + 32) / 64).max(2),
            b: 0,
            n: 1,
            c: 0,
        };
        Decoder {
            header: *header,
            range,
            qbpp: bits_of(range),
            limit: 2 * (bpp + bpp.max(8)),
            contexts: vec![context; 365],
            ends: [context; 2],
            run_index: 0,
            bits: Bits::new(bytes),
        }
    }

    fn row(&mut self, above: &[i32], row: &mut [i32]) {
        let end = row.len() - 1;
        let mut x = 1;
        while x < end {
            let [a, b, c, d] = [row[x - 1], above[x], above[x - 1], above[x + 1]];
            let gradients = [d - b, b - c, c - a];
            if gradients
                .iter()
                .any(|gradient| gradient.abs() > self.header.near)
            {
                row[x] = self.regular(gradients, [a, b, c]);
                x += 1;
                continue;
            }
            let length = self.run(end - x);
            row[x..x + length].fill(a);
            x += length;
            if x < end {
                row[x] = self.end_of_run(a, above[x]);
                x += 1;
            }
        }
    }

    fn regular(&mut self, gradients: [i32; 3], [a, b, c]: [i32; 3]) -> i32 {
        let [q1, q2, q3] = gradients.map(|gradient| self.quantised(gradient));
        let index = 81 * q1 + 9 * q2 + q3;
        let sign = index.signum();
        let context = &mut self.contexts[index.unsigned_abs() as usize];
        let predicted = match c {
            c if c >= a.max(b) => a.min(b),
            c if c <= a.min(b) => a.max(b),
            c => a + b - c,
        };
        let predicted = (predicted + sign * context.c).clamp(0, self.header.max);
        let k = golomb_parameter(context.n, context.a);
        let mapped = self.bits.golomb(k, self.limit, self.qbpp);
        let is_biased = self.header.near == 0 && k == 0 && 2 * context.b <= -context.n;
        let error = match (is_biased, mapped & 1) {
            (false, 0) => mapped / 2,
            (false, _) => -(mapped / 2) - 1,
            (true, 0) => -(mapped / 2) - 1,
            (true, _) => mapped / 2,
        };
        context.learn(error, self.header);
        self.reconstructed(predicted, sign * error)
    }

    fn quantised(&self, gradient: i32) -> i32 {
        let [t1, t2, t3] = self.header.thresholds;
        let size = gradient.abs();
        let class = match size {
            _ if size <= self.header.near => 0,
            _ if size < t1 => 1,
            _ if size < t2 => 2,
            _ if size < t3 => 3,
            _ => 4,
        };
        gradient.signum() * class
    }

    /// Reads the length of a run of equal pixels, of those that are `left` in the row.
    fn run(&mut self, left: usize) -> usize {
        let mut length = 0;
        while length < left && self.bits.bit() == 1 {
            let step = 1 << J[self.run_index];
            if length + step > left {
                return left;
            }
            length += step;
            self.run_index = (self.run_index + 1).min(J.len() - 1);
        }
        if length < left {
            let rest = self.bits.take(J[self.run_index]) as usize;
            // A run that ends with the row is not written in this way.
            length = (length + rest).min(left);
        }
        length
    }

    fn end_of_run(&mut self, a: i32, b: i32) -> i32 {
        let is_flat = (a - b).abs() <= self.header.near;
        let kind = i32::from(is_flat);
        let context = &mut self.ends[kind as usize];
        let sum = context.a + if is_flat { context.n >> 1 } else { 0 };
        let k = golomb_parameter(context.n, sum);
        let mapped = self
            .bits
            .golomb(k, self.limit - J[self.run_index] - 1, self.qbpp);
        let doubled = mapped + kind;
        let size = (doubled + 1) / 2;
        let is_odd = doubled & 1 == 1;
        let is_negative = (k != 0 || 2 * context.b >= context.n) == is_odd;
        let error = if is_negative { -size } else { size };
        context.a = context.a.saturating_add((mapped + 1 - kind) >> 1);
        context.b += i32::from(error < 0);
        if context.n == self.header.reset {
            (context.a, context.b, context.n) = (context.a >> 1, context.b >> 1, context.n >> 1);
        }
        context.n += 1;
        self.run_index = self.run_index.saturating_sub(1);
        if is_flat {
            self.reconstructed(a, error)
        } else if a > b {
            self.reconstructed(b, -error)
        } else {
            self.reconstructed(b, error)
        }
    }

    fn reconstructed(&self, predicted: i32, error: i32) -> i32 {
        let Header { near, max, .. } = self.header;
        let step = 2 * near + 1;
        let mut value = predicted + error * step;
        if value < -near {
            value += self.range * step;
        } else if value > max + near {
            value -= self.range * step;
        }
        value.clamp(0, max)
    }
}

impl Context {
    fn learn(&mut self, error: i32, header: Header) {
        self.a = self.a.saturating_add(error.abs());
        self.b = self.b.saturating_add(error * (2 * header.near + 1));
        if self.n == header.reset {
            (self.a, self.b, self.n) = (self.a >> 1, self.b >> 1, self.n >> 1);
        }
        self.n += 1;
        if self.b <= -self.n {
            self.b = (self.b + self.n).max(1 - self.n);
            self.c = (self.c - 1).max(-128);
        } else if self.b > 0 {
            self.b = (self.b - self.n).min(0);
            self.c = (self.c + 1).min(127);
        }
    }
}

fn golomb_parameter(n: i32, a: i32) -> u32 {
    let is_enough = |k: &u32| i64::from(n) << k >= i64::from(a);
    (0..24).find(is_enough).unwrap_or(24)
}
