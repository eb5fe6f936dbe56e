//! A hash of 128 bits: it tells data apart that differ by chance or mistake, not by malice.

use xxhash_rust::xxh3::Xxh3;

#[derive(Default)]
pub struct Fingerprint(Xxh3);

impl Fingerprint {
    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    pub fn with(mut self, bytes: &[u8]) -> Fingerprint {
        self.add(bytes);
        self
    }

    pub fn bytes(&self) -> [u8; 16] {
        self.0.digest128().to_le_bytes()
    }

    /// The hash in 32 hexadecimal digits.
    pub fn text(&self) -> String {
        format!("{:032x}", self.0.digest128())
    }
}
