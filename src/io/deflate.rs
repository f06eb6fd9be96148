//! Deflate, by `flate2`.
//!
//! Source: Deutsch, RFC 1950 and RFC 1951.

use std::cell::RefCell;

use flate2::{Compress, Compression, FlushCompress, Status};

/// Above it the files hardly become smaller; 5 and 6 are what VTK and gzip take.
pub(super) const LEVEL: u32 = 6;

thread_local! {
    // Kept from piece to piece: a compressor's tables take a third of a mebibyte, and to make them anew for each piece
    // leaves the heap in shreds.
    static RAW: RefCell<Compress> = RefCell::new(Compress::new(Compression::new(LEVEL), false));
    static ZLIB: RefCell<Compress> = RefCell::new(Compress::new(Compression::new(LEVEL), true));
}

/// A piece of raw deflate that ends at a byte and refers to nothing before it, so that pieces may follow each other.
pub(super) fn piece(bytes: &[u8]) -> Vec<u8> {
    RAW.with_borrow_mut(|deflate| deflated(bytes, deflate, FlushCompress::Sync))
}

/// An empty last block, which ends a stream of pieces.
pub(super) const LAST: [u8; 2] = [3, 0];

/// A whole stream of raw deflate.
pub(crate) fn raw(bytes: &[u8]) -> Vec<u8> {
    RAW.with_borrow_mut(|deflate| deflated(bytes, deflate, FlushCompress::Finish))
}

/// A zlib stream.
pub(super) fn zlib(bytes: &[u8]) -> Vec<u8> {
    ZLIB.with_borrow_mut(|deflate| deflated(bytes, deflate, FlushCompress::Finish))
}

fn deflated(bytes: &[u8], deflate: &mut Compress, flush: FlushCompress) -> Vec<u8> {
    deflate.reset();
    let mut out = Vec::with_capacity(bytes.len() / 2 + 1024);
    loop {
        let done = deflate.total_in() as usize;
        let status = deflate.compress_vec(&bytes[done..], &mut out, flush);
        // Room that is left says that a flush is complete.
        let all = deflate.total_in() as usize == bytes.len() && out.len() < out.capacity();
        let ended = matches!(status, Ok(Status::StreamEnd) | Err(_));
        if ended || matches!(flush, FlushCompress::Sync) && all {
            return out;
        }
        out.reserve(bytes.len() / 8 + 1024);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read as _;

    #[test]
    fn pieces_of_any_bytes_can_be_put_together() {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 56) as u8
        };
        let pieces: Vec<Vec<u8>> = [0, 1, 5, 1000, 300_000, 70_000]
            .map(|n| {
                (0..n)
                    .map(|i| {
                        if n == 1000 {
                            7
                        } else {
                            random() ^ (i % 2) as u8
                        }
                    })
                    .collect()
            })
            .to_vec();
        let mut stream: Vec<u8> = pieces.iter().flat_map(|p| piece(p)).collect();
        stream.extend(LAST);
        let mut found = Vec::new();
        let mut reader = flate2::bufread::DeflateDecoder::new(&stream[..]);
        reader.read_to_end(&mut found).unwrap();
        assert_eq!(found, pieces.concat());
        for one in &pieces {
            let stream = raw(one);
            let mut found = Vec::new();
            let mut reader = flate2::bufread::DeflateDecoder::new(&stream[..]);
            reader.read_to_end(&mut found).unwrap();
            assert_eq!(found, *one);
            let stream = zlib(one);
            let mut found = Vec::new();
            let mut reader = flate2::bufread::ZlibDecoder::new(&stream[..]);
            reader.read_to_end(&mut found).unwrap();
            assert_eq!(found, *one);
        }
    }
}
