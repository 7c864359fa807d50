//! The header of a netCDF-3 file: what is declared, checked against the bytes that there are.

use std::collections::HashMap;
use std::path::Path;

use super::{
    ATTRIBUTES, Classic, DIMENSIONS, VARIABLES, Variable, number_of, numbers, padding, refuse,
    text_of,
};
use crate::error::{Error, Place, Result};
use crate::io::scalar::Number;
use crate::mesh::Values;

/// The header of a classic file.
pub(super) struct Header<'a> {
    pub(super) path: &'a Path,
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Header<'a> {
    fn error(&self, what: impl Into<String>) -> Error {
        refuse(
            self.path,
            Place::SectionByte("netCDF header".into(), self.at as u64),
            what,
        )
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let end = self.at.checked_add(count);
        let found = end.and_then(|end| self.bytes.get(self.at..end));
        let found = found.ok_or_else(|| self.error("the header ends too early"))?;
        self.at += count;
        Ok(found)
    }

    fn u32(&mut self) -> Result<u32> {
        Ok(self
            .take(4)?
            .iter()
            .fold(0, |all, &byte| all << 8 | u32::from(byte)))
    }

    fn u64(&mut self) -> Result<u64> {
        Ok(u64::from(self.u32()?) << 32 | u64::from(self.u32()?))
    }

    /// A number of things, which CDF-5 has in 64 bits.
    fn count(&mut self) -> Result<usize> {
        let count = if self.version() == 5 {
            self.u64()?
        } else {
            self.u32()?.into()
        };
        usize::try_from(count).map_err(|_| self.error(format!("{count} is too many")))
    }

    fn version(&self) -> u8 {
        self.bytes.get(3).copied().unwrap_or(1)
    }

    fn padded(&mut self, count: usize) -> Result<&'a [u8]> {
        let bytes = self.take(count)?;
        self.take(padding(count))?;
        Ok(bytes)
    }

    fn name(&mut self) -> Result<String> {
        let length = self.count()?;
        Ok(text_of(self.padded(length)?))
    }

    /// The length of a list that begins with this mark, none of whose items takes less than `least` bytes.
    fn list(&mut self, mark: u32, least: usize) -> Result<usize> {
        let found = self.u32()?;
        let count = self.count()?;
        if found != mark && (found, count) != (0, 0) {
            return Err(self.error(format!("there is {found} where a list begins with {mark}")));
        }
        if count.saturating_mul(least) > self.bytes.len() - self.at {
            return Err(self.error(format!(
                "{count} entries are more than the file has bytes for"
            )));
        }
        Ok(count)
    }

    fn number(&mut self) -> Result<Number> {
        let kind = self.u32()?;
        number_of(kind).ok_or_else(|| self.error(format!("netCDF has no type {kind}")))
    }

    fn attributes(&mut self) -> Result<HashMap<String, Values>> {
        let mut attributes = HashMap::new();
        for _ in 0..self.list(ATTRIBUTES, 12)? {
            let name = self.name()?;
            let number = self.number()?;
            let bytes = self.count()?.saturating_mul(number.size());
            attributes.insert(name, numbers(number, self.padded(bytes)?.into()).values());
        }
        Ok(attributes)
    }

    pub(super) fn read(mut self) -> Result<Classic<'a>> {
        let version = self.version();
        let records = self.count()?;
        let mut dimensions = Vec::new();
        for _ in 0..self.list(DIMENSIONS, 8)? {
            dimensions.push((self.name()?, self.count()?));
        }
        let attributes = self.attributes()?;
        let mut variables = Vec::new();
        for _ in 0..self.list(VARIABLES, 28)? {
            variables.push(self.variable(&dimensions)?);
        }
        let sizes = variables.iter().filter(|(_, v)| v.is_record).map(|(_, v)| {
            let inner = v
                .shape
                .iter()
                .skip(1)
                .try_fold(v.number.size(), |all, &n| all.checked_mul(n));
            inner.filter(|&size| size <= self.bytes.len())
        });
        let too_large = || self.error("a record is larger than the file");
        let sizes = sizes
            .collect::<Option<Vec<usize>>>()
            .ok_or_else(too_large)?;
        let record = match sizes[..] {
            [one] => one,
            _ => sizes.iter().map(|&size| size + padding(size)).sum(),
        };
        // A program that is still writing does not know the number of records.
        let streaming = if version == 5 {
            u64::MAX
        } else {
            u32::MAX.into()
        };
        let first = variables
            .iter()
            .filter(|(_, v)| v.is_record)
            .map(|(_, v)| v.begin)
            .min();
        let records = match first {
            Some(first) if records as u64 == streaming && record > 0 => {
                self.bytes.len().saturating_sub(first) / record
            }
            _ => records,
        };
        let mut total = 0_usize;
        for (name, variable) in &mut variables {
            if variable.is_record {
                variable.shape[0] = records;
            }
            total = total.saturating_add(self.check(name, variable, record)?);
        }
        if total > self.bytes.len() {
            return Err(self.error("its variables together are larger than the file"));
        }
        for (_, length) in dimensions.iter_mut().filter(|(_, length)| *length == 0) {
            *length = records;
        }
        Ok(Classic {
            bytes: self.bytes,
            version,
            dimensions,
            attributes,
            variables: variables.into_iter().collect(),
            record,
        })
    }

    fn variable(&mut self, dimensions: &[(String, usize)]) -> Result<(String, Variable)> {
        let name = self.name()?;
        let rank = self.count()?;
        if rank > self.bytes.len() {
            return Err(self.error(format!("the variable {name} has {rank} dimensions")));
        }
        let (mut shape, mut is_record) = (Vec::new(), false);
        for k in 0..rank {
            let number = self.count()?;
            let Some((_, length)) = dimensions.get(number) else {
                return Err(self.error(format!(
                    "the variable {name} has a dimension {number} that is not there"
                )));
            };
            is_record |= k == 0 && *length == 0;
            shape.push(*length);
        }
        let attributes = self.attributes()?;
        let number = self.number()?;
        // The size in bytes, which follows from the shape and overflows for large variables.
        self.count()?;
        let begin = if self.version() == 1 {
            self.u32()?.into()
        } else {
            self.u64()?
        };
        let begin =
            usize::try_from(begin).map_err(|_| self.error("data beyond the end of the file"))?;
        let variable = Variable {
            shape,
            attributes,
            number,
            begin,
            is_record,
        };
        Ok((name, variable))
    }

    /// Whether all data of a variable are in the file; their bytes.
    fn check(&self, name: &str, variable: &Variable, record: usize) -> Result<usize> {
        let skipped = usize::from(variable.is_record);
        let mut inner = variable.shape.iter().skip(skipped);
        let size = inner.try_fold(variable.number.size(), |all, &n| all.checked_mul(n));
        let last = match variable.is_record {
            true => variable.shape[0]
                .checked_sub(1)
                .map(|last| last.checked_mul(record)),
            false => Some(Some(0)),
        };
        let Some(last) = last else {
            return Ok(0);
        };
        let end = size
            .zip(last)
            .and_then(|(size, last)| size.checked_add(last)?.checked_add(variable.begin));
        if let (Some(size), Some(end)) = (size, end)
            && end <= self.bytes.len()
        {
            let times = if variable.is_record {
                variable.shape[0]
            } else {
                1
            };
            return Ok(size.saturating_mul(times));
        }
        let what = format!(
            "the variable {name} of the shape {:?} would reach beyond the {} bytes of the file",
            variable.shape,
            self.bytes.len()
        );
        Err(refuse(self.path, Place::Byte(variable.begin as u64), what))
    }
}
