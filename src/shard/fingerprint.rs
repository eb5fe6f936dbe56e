//! A hash of 128 bits: it tells data apart that differ by chance or mistake, not by malice.

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;

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

    /// The hash of a file's bytes, as 32 hexadecimal digits. Only regular files are opened, since opening a pipe may wait
    /// for ever.
    pub fn of_file(path: &Path) -> io::Result<String> {
        if !path.metadata()?.is_file() {
            return Err(io::ErrorKind::InvalidInput.into());
        }
        let mut reader = BufReader::with_capacity(1 << 20, File::open(path)?);
        let mut fingerprint = Fingerprint::default();
        loop {
            let bytes = reader.fill_buf()?;
            if bytes.is_empty() {
                return Ok(fingerprint.text());
            }
            fingerprint.add(bytes);
            let count = bytes.len();
            reader.consume(count);
        }
    }

    pub fn bytes(&self) -> [u8; 16] {
        self.0.digest128().to_le_bytes()
    }

    /// The hash in 32 hexadecimal digits.
    pub fn text(&self) -> String {
        format!("{:032x}", self.0.digest128())
    }
}
