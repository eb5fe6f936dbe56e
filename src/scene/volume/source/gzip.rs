//! Gzip: members one after another, as programs that pack in parallel write them, and zeros behind the last, with
//! which some fill up a block.

use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::GzDecoder;

const BUFFER: usize = 32 << 10;

/// The decoded bytes of all members.
pub struct Members<R> {
    /// `None` behind the last.
    member: Option<GzDecoder<BufReader<R>>>,
}

impl<R: Read> Members<R> {
    pub fn new(packed: R) -> Members<R> {
        let packed = BufReader::with_capacity(BUFFER, packed);
        Members {
            member: Some(GzDecoder::new(packed)),
        }
    }
}

impl<R: Read> Read for Members<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = &mut self.member {
            let count = member.read(bytes)?;
            if count > 0 || bytes.is_empty() {
                return Ok(count);
            }
            let has_more = is_behind_zeros(member.get_mut())?;
            let last = self.member.take().filter(|_| has_more);
            self.member = last.map(|last| GzDecoder::new(last.into_inner()));
        }
        Ok(0)
    }
}

/// Whether anything follows the zeros that come next, which are skipped.
fn is_behind_zeros(packed: &mut impl BufRead) -> io::Result<bool> {
    loop {
        let next = packed.fill_buf()?;
        let zeros = next.iter().take_while(|byte| **byte == 0).count();
        let (is_end, has_more) = (next.is_empty(), zeros < next.len());
        packed.consume(zeros);
        if is_end || has_more {
            return Ok(has_more);
        }
    }
}
