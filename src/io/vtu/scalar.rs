//! Numbers as VTU stores them: each type's name, width, bytes and decimal form.

use crate::io::out::Out;
use crate::mesh::Values;
use rayon::prelude::*;
use vtkio::IOBuffer;

/// A number type of VTU.
pub(super) trait Scalar: Copy + Default + Send + Sync {
    /// The `type` attribute.
    const NAME: &'static str;
    /// Bytes of one value.
    const WIDTH: usize;
    /// What stands where there is no value: NaN, or 0 where the type has none.
    const MISSING: Self;

    fn from_bytes(bytes: &[u8], big_endian: bool) -> Vec<Self>;
    fn append_le(values: &[Self], out: &mut Out);
    /// Reads the decimal form; floats also `nan` and `inf` in any case.
    fn parse(word: &[u8]) -> Option<Self>;
    /// Appends the shortest decimal form that reads back as the same number.
    fn print(self, out: &mut Vec<u8>);
    fn values(numbers: Vec<Self>) -> Values;
    /// The numbers, if they are of this type.
    fn of_values(values: &Values) -> Option<&[Self]>;
    fn buffer(numbers: Vec<Self>) -> IOBuffer;
}

macro_rules! scalar {
    ($($type:ident $variant:ident $name:literal $missing:expr, $parse:expr, $print:expr;)*) => { $(
        impl Scalar for $type {
            const NAME: &'static str = $name;
            const WIDTH: usize = size_of::<$type>();
            const MISSING: $type = $missing;

            fn from_bytes(bytes: &[u8], big_endian: bool) -> Vec<Self> {
                let (words, _) = bytes.as_chunks();
                let words = words.par_iter().with_min_len(1 << 14);
                if big_endian {
                    words.map(|&word| <$type>::from_be_bytes(word)).collect()
                } else {
                    words.map(|&word| <$type>::from_le_bytes(word)).collect()
                }
            }

            fn append_le(values: &[Self], out: &mut Out) {
                out.rows(values.len(), Self::WIDTH, |index, row| {
                    if let Some(value) = values.get(index) {
                        row.copy_from_slice(&value.to_le_bytes());
                    }
                });
            }

            fn parse(word: &[u8]) -> Option<Self> {
                $parse(word)
            }

            fn print(self, out: &mut Vec<u8>) {
                $print(self, out)
            }

            fn values(numbers: Vec<Self>) -> Values {
                Values::$variant(numbers)
            }

            fn of_values(values: &Values) -> Option<&[Self]> {
                match values {
                    Values::$variant(numbers) => Some(numbers),
                    _ => None,
                }
            }

            fn buffer(numbers: Vec<Self>) -> IOBuffer {
                IOBuffer::$variant(numbers)
            }
        }
    )* };
}

scalar! {
    i8 I8 "Int8" 0, parse_int, print_int;
    u8 U8 "UInt8" 0, parse_int, print_int;
    i16 I16 "Int16" 0, parse_int, print_int;
    u16 U16 "UInt16" 0, parse_int, print_int;
    i32 I32 "Int32" 0, parse_int, print_int;
    u32 U32 "UInt32" 0, parse_int, print_int;
    i64 I64 "Int64" 0, parse_int, print_int;
    u64 U64 "UInt64" 0, parse_int, print_int;
    f32 F32 "Float32" f32::NAN, parse_float, print_float;
    f64 F64 "Float64" f64::NAN, parse_float, print_float;
}

fn parse_int<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn parse_float<T: fast_float2::FastFloat>(word: &[u8]) -> Option<T> {
    fast_float2::parse(word).ok()
}

fn print_int<T: itoa::Integer>(value: T, out: &mut Vec<u8>) {
    out.extend_from_slice(itoa::Buffer::new().format(value).as_bytes());
}

fn print_float<T: zmij::Float>(value: T, out: &mut Vec<u8>) {
    // Gives "NaN", "inf" and "-inf" for the rest, which both sides read.
    out.extend_from_slice(zmij::Buffer::new().format(value).as_bytes());
}

/// Moves an array of `vtkio`'s model into ours.
pub(super) fn values(buffer: IOBuffer) -> Values {
    match buffer {
        IOBuffer::I8(numbers) => Values::I8(numbers),
        IOBuffer::Bit(numbers) | IOBuffer::U8(numbers) => Values::U8(numbers),
        IOBuffer::I16(numbers) => Values::I16(numbers),
        IOBuffer::U16(numbers) => Values::U16(numbers),
        IOBuffer::I32(numbers) => Values::I32(numbers),
        IOBuffer::U32(numbers) => Values::U32(numbers),
        IOBuffer::I64(numbers) => Values::I64(numbers),
        IOBuffer::U64(numbers) => Values::U64(numbers),
        IOBuffer::F32(numbers) => Values::F32(numbers),
        IOBuffer::F64(numbers) => Values::F64(numbers),
    }
}
