//! The packed bytes of one array, taken one after the other.

use base64::Engine as _;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::borrow::Cow;

/// The bytes of an array in a file.
pub(super) enum Stream<'a> {
    Raw(&'a [u8]),
    Base64(Base64<'a>),
}

impl<'a> Stream<'a> {
    pub fn base64(text: Cow<'a, [u8]>) -> Self {
        Stream::Base64(Base64 {
            text,
            at: 0,
            left_over: Vec::new(),
        })
    }

    /// An upper bound of the remaining bytes.
    pub fn remaining(&self) -> u64 {
        match self {
            Stream::Raw(bytes) => bytes.len() as u64,
            Stream::Base64(stream) => {
                (stream.left_over.len() + (stream.text.len() - stream.at).div_ceil(4) * 3) as u64
            }
        }
    }

    pub fn take(&mut self, count: u64) -> Result<Cow<'a, [u8]>, String> {
        let missing = |there| format!("{count} bytes are declared where at most {there} fit");
        if count > self.remaining() {
            return Err(missing(self.remaining()));
        }
        let count = count as usize;
        match self {
            Stream::Raw(bytes) => {
                let (taken, rest) = bytes.split_at(count);
                *bytes = rest;
                Ok(Cow::Borrowed(taken))
            }
            Stream::Base64(stream) => {
                let taken = stream.take(count)?;
                if taken.len() < count {
                    return Err(missing(taken.len() as u64));
                }
                Ok(Cow::Owned(taken))
            }
        }
    }
}

/// Base64 in one or several padded runs. `vtkio` expects header and data in one run; many writers encode them
/// separately.
pub(super) struct Base64<'a> {
    text: Cow<'a, [u8]>,
    at: usize,
    left_over: Vec<u8>,
}

const LENIENT: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

impl Base64<'_> {
    /// The next `count` bytes, fewer at the end of the text.
    fn take(&mut self, count: usize) -> Result<Vec<u8>, String> {
        let mut out = std::mem::take(&mut self.left_over);
        out.reserve(count.saturating_sub(out.len()) + 3);
        while out.len() < count {
            let rest = &self.text[self.at..];
            let wanted = (count - out.len()).div_ceil(3) * 4;
            let mut run = &rest[..wanted.min(rest.len())];
            if let Some(padding) = memchr::memchr(b'=', run) {
                run = &run[..((padding / 4 + 1) * 4).min(run.len())];
            }
            if run.is_empty() {
                break;
            }
            LENIENT
                .decode_vec(run, &mut out)
                .map_err(|error| format!("not base64: {error}"))?;
            self.at += run.len();
        }
        self.left_over = out.split_off(count.min(out.len()));
        Ok(out)
    }
}
