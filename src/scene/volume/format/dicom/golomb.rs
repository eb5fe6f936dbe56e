//! The bits of a JPEG-LS codestream, and the Golomb codes in them.

/// Reads bits; the first bit after a byte of ones is skipped.
pub struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    buffer: u64,
    filled: u32,
    /// Bits that were read beyond the end.
    missing: u32,
}

impl Bits<'_> {
    pub fn new(bytes: &[u8]) -> Bits<'_> {
        Bits {
            bytes,
            at: 0,
            buffer: 0,
            filled: 0,
            missing: 0,
        }
    }

    pub fn is_exhausted(&self) -> bool {
        self.missing > 0
    }

    /// Reads up to 24 bits.
    pub fn take(&mut self, count: u32) -> u32 {
        while self.filled < count {
            let is_stuffed = self.at > 0 && self.bytes.get(self.at - 1) == Some(&0xff);
            let byte = self.bytes.get(self.at).copied();
            // A marker ends the pixels.
            let byte = byte.filter(|byte| !is_stuffed || *byte < 0x80);
            let width = if is_stuffed { 7 } else { 8 };
            match byte {
                Some(_) => self.at += 1,
                None => self.missing += 1,
            }
            self.buffer = self.buffer << width | u64::from(byte.unwrap_or(0));
            self.filled += width;
        }
        self.filled -= count;
        (self.buffer >> self.filled) as u32 & ((1 << count) - 1)
    }

    pub fn bit(&mut self) -> u32 {
        self.take(1)
    }

    /// Reads an error in a code of at most `limit` bits.
    pub fn golomb(&mut self, k: u32, limit: u32, qbpp: u32) -> i32 {
        let most = limit.saturating_sub(qbpp + 1);
        let mut zeros = 0;
        while self.bit() == 0 {
            zeros += 1;
            if zeros > most {
                // Damaged, or at an end.
                break;
            }
        }
        let code = if zeros < most {
            u64::from(zeros) << k | u64::from(self.take(k))
        } else {
            u64::from(self.take(qbpp)) + 1
        };
        // No error of 16 bits is longer; a damaged code must not overflow.
        code.min(1 << 17) as i32
    }
}
