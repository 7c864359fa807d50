//! The types of numbers in files: of each its name, width, bytes and decimal form.

use crate::io::rows;
use crate::mesh::Values;

/// Evaluates one expression for the type that a [`Number`] stands for.
macro_rules! with_type {
    ($number:expr, $type:ident => $run:expr) => {
        $crate::io::scalar::with_type!(
            @match $number, $type => $run;
            I8 i8 U8 u8 I16 i16 U16 u16 I32 i32 U32 u32 I64 i64 U64 u64 F32 f32 F64 f64
        )
    };
    (@match $number:expr, $type:ident => $run:expr; $($variant:ident $number_type:ident)*) => {
        match $number {
            $($crate::io::scalar::Number::$variant => {
                type $type = $number_type;
                $run
            })*
        }
    };
}
pub(crate) use with_type;

/// A number.
pub(crate) trait Scalar: Copy + Default + Send + Sync {
    const TYPE: Number;
    /// Bytes of one value.
    const WIDTH: usize;
    /// Stands for a missing value: NaN, or 0 for integers.
    const MISSING: Self;

    fn from_bytes(bytes: &[u8], big_endian: bool) -> Vec<Self>;
    /// [`Scalar::from_bytes`], one after the other.
    fn each(bytes: &[u8], big_endian: bool) -> impl ExactSizeIterator<Item = Self>;
    /// As a coordinate.
    fn float(self) -> f64;
    /// Writes numbers as little-endian bytes until either runs out.
    fn put_le(values: &[Self], bytes: &mut [u8]);
    /// The value as an index; `None` unless it is an integer of at least 0.
    fn index(self) -> Option<u64>;
    /// The value as an index beyond `base`, and something other than 0 if it does not fit into 32 bits.
    fn index_from(self, base: u32) -> (u32, u32);
    /// Reads the decimal form; floats also `nan` and `inf` in any case.
    fn parse(word: &[u8]) -> Option<Self>;
    /// Appends the shortest decimal form that reads back as the same number.
    fn print(self, out: &mut Vec<u8>);
    fn values(numbers: Vec<Self>) -> Values;
    /// The numbers, if they are of this type.
    fn of_values(values: &Values) -> Option<&[Self]>;
}

macro_rules! scalar {
    ($($type:ident $variant:ident $name:literal $missing:expr, $parse:expr, $print:expr, $index:expr;)*) => {
        /// A type of numbers.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Number {
            $($variant),*
        }

        impl Number {
            /// Each type with VTK's name of it.
            const NAMES: [(Number, &'static str); 10] = [$((Number::$variant, $name)),*];

            /// Bytes of one number.
            pub fn size(self) -> usize {
                match self { $(Number::$variant => size_of::<$type>()),* }
            }

            pub fn of(values: &Values) -> Self {
                match values { $(Values::$variant(_) => Number::$variant),* }
            }
        }

        $(impl Scalar for $type {
            const TYPE: Number = Number::$variant;
            const WIDTH: usize = size_of::<$type>();
            const MISSING: $type = $missing;

            fn from_bytes(bytes: &[u8], big_endian: bool) -> Vec<Self> {
                let mut values = Vec::new();
                let width = size_of::<$type>();
                rows::fill(&mut values, bytes.len() / width, 1, |first, values| {
                    let bytes = bytes.get(first * width..).unwrap_or_default();
                    values.iter_mut().zip(Self::each(bytes, big_endian)).for_each(|(to, word)| *to = word);
                    true
                });
                values
            }

            #[inline]
            fn each(bytes: &[u8], big_endian: bool) -> impl ExactSizeIterator<Item = Self> {
                let words = bytes.as_chunks().0.iter();
                words.map(move |&word| {
                    if big_endian {
                        <$type>::from_be_bytes(word)
                    } else {
                        <$type>::from_le_bytes(word)
                    }
                })
            }

            #[inline]
            fn float(self) -> f64 {
                self as f64
            }

            fn put_le(values: &[Self], bytes: &mut [u8]) {
                for (word, value) in bytes.as_chunks_mut().0.iter_mut().zip(values) {
                    *word = value.to_le_bytes();
                }
            }

            #[inline]
            fn index(self) -> Option<u64> {
                $index(self)
            }

            #[inline]
            fn index_from(self, base: u32) -> (u32, u32) {
                if Self::WIDTH == 8 && Self::default().index().is_some() {
                    let index = (self as u64).wrapping_sub(base.into());
                    return (index as u32, (index >> 32) as u32);
                }
                let index = self as u32;
                let odd = self.index().is_none() | (index < base);
                (index.wrapping_sub(base), odd.into())
            }

            fn parse(word: &[u8]) -> Option<Self> {
                $parse(word)
            }

            fn print(self, out: &mut Vec<u8>) {
                $print(self, out)
            }

            fn values(numbers: Vec<Self>) -> Values {
                Values::$variant(numbers.into())
            }

            fn of_values(values: &Values) -> Option<&[Self]> {
                match values {
                    Values::$variant(numbers) => Some(numbers),
                    _ => None,
                }
            }
        })*
    };
}

scalar! {
    i8 I8 "Int8" 0, parse_int, print_int, index_of;
    u8 U8 "UInt8" 0, parse_int, print_int, index_of;
    i16 I16 "Int16" 0, parse_int, print_int, index_of;
    u16 U16 "UInt16" 0, parse_int, print_int, index_of;
    i32 I32 "Int32" 0, parse_int, print_int, index_of;
    u32 U32 "UInt32" 0, parse_int, print_int, index_of;
    i64 I64 "Int64" 0, parse_int, print_int, index_of;
    u64 U64 "UInt64" 0, parse_int, print_int, index_of;
    f32 F32 "Float32" f32::NAN, parse_float, print_float, |_| None;
    f64 F64 "Float64" f64::NAN, parse_float, print_float, |_| None;
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
    // Gives "NaN", "inf" and "-inf" for non-finite values, which VTK and meshio read.
    out.extend_from_slice(zmij::Buffer::new().format(value).as_bytes());
}

#[inline]
fn index_of<T: TryInto<u64>>(value: T) -> Option<u64> {
    value.try_into().ok()
}

impl Number {
    /// VTK's name.
    pub fn name(self) -> &'static str {
        let found = Self::NAMES.iter().find(|(number, _)| *number == self);
        found.map_or("", |(_, name)| name)
    }

    /// The type that VTK calls so, in any case.
    pub fn of_name(name: &str) -> Option<Self> {
        let mut all = Self::NAMES.iter();
        let found = all.find(|(_, known)| known.eq_ignore_ascii_case(name));
        found.map(|(number, _)| *number)
    }

    pub fn is_float(self) -> bool {
        matches!(self, Number::F32 | Number::F64)
    }

    /// Whether these are integers without a sign.
    pub fn is_unsigned(self) -> bool {
        matches!(self, Number::U8 | Number::U16 | Number::U32 | Number::U64)
    }

    /// The floats of this many bytes.
    pub fn float(size: usize) -> Option<Self> {
        [Number::F32, Number::F64]
            .into_iter()
            .find(|of| of.size() == size)
    }

    /// The integers of this many bytes.
    pub fn integer(size: usize, is_signed: bool) -> Option<Self> {
        let mut all = Self::NAMES.iter().map(|(number, _)| *number);
        all.find(|of| !of.is_float() && of.is_unsigned() != is_signed && of.size() == size)
    }

    /// The number that these bytes begin with; 0 if they are too few.
    pub fn read(self, bytes: &[u8], big_endian: bool) -> f64 {
        with_type!(self, T => T::each(bytes, big_endian).next().map_or(0.0, T::float))
    }
}
