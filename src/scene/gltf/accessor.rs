//! Numbers out of accessors, with every extent checked before it is read.

use super::super::Error;
use super::EXPORT_ANEW;
use super::container::Source;
use glam::DVec3;
use gltf::json::Index;
use gltf::json::accessor::{
    Accessor, ComponentType, GenericComponentType, IndexComponentType, Type, sparse::Sparse,
};
use gltf::json::buffer::View;
use gltf::json::validation::{Checked, USize64};

use ComponentType::{F32, I8, I16, U8, U16, U32};

/// What an accessor is read for.
pub(super) struct Wanted<'a> {
    /// Scalars, vectors or matrices.
    pub shape: Type,
    /// What its components may be.
    pub components: &'a [ComponentType],
    /// How many elements; none for any number.
    pub count: Option<usize>,
}

/// Components of a vertex attribute, those of KHR_mesh_quantization among them.
pub(super) const ATTRIBUTE: &[ComponentType] = &[F32, I8, U8, I16, U16];
/// Components of what is always a float.
pub(super) const FLOAT: &[ComponentType] = &[F32];
/// Components of the indices of triangles.
pub(super) const INDEX: &[ComponentType] = &[U8, U16, U32];
/// Components of the indices of joints.
pub(super) const JOINT: &[ComponentType] = &[U8, U16];
/// Components of the weights of joints.
pub(super) const WEIGHT: &[ComponentType] = &[F32, U8, U16];

impl Source<'_> {
    /// The components of an accessor, element by element, normalised integers as the fractions they stand for. `place`
    /// says what refers to it.
    pub fn numbers(
        &self,
        index: Index<Accessor>,
        place: &str,
        wanted: &Wanted,
    ) -> Result<Vec<f64>, Error> {
        self.read(index, wanted)
            .map_err(|problem| self.fault(&format!("{place} (accessor {index}): {problem}")))
    }

    /// As [`Source::numbers`], as vectors that are finite.
    pub fn vectors(
        &self,
        index: Index<Accessor>,
        place: &str,
        components: &[ComponentType],
        count: Option<usize>,
    ) -> Result<Vec<DVec3>, Error> {
        let wanted = Wanted {
            shape: Type::Vec3,
            components,
            count,
        };
        let numbers = self.finite(index, place, &wanted)?;
        Ok(numbers.chunks_exact(3).map(DVec3::from_slice).collect())
    }

    /// As [`Source::numbers`], which are finite.
    pub fn finite(
        &self,
        index: Index<Accessor>,
        place: &str,
        wanted: &Wanted,
    ) -> Result<Vec<f64>, Error> {
        let numbers = self.numbers(index, place, wanted)?;
        match numbers.iter().position(|v| !v.is_finite()) {
            None => Ok(numbers),
            Some(at) => Err(self.fault(&format!(
                "{place} (accessor {index}): element {} is not finite ({}); repair it or {EXPORT_ANEW}",
                at / wanted.shape.multiplicity(),
                numbers[at]
            ))),
        }
    }

    fn read(&self, index: Index<Accessor>, wanted: &Wanted) -> Result<Vec<f64>, String> {
        let accessor = self.root.accessors.get(index.value());
        let accessor =
            accessor.ok_or_else(|| format!("there is no such accessor; {EXPORT_ANEW}"))?;
        let (Checked::Valid(GenericComponentType(component)), Checked::Valid(shape)) =
            (accessor.component_type, accessor.type_)
        else {
            return Err(format!("its type is none of glTF 2.0; {EXPORT_ANEW}"));
        };
        if shape != wanted.shape || !wanted.components.contains(&component) {
            return Err(format!(
                "it holds {shape:?} of {component:?}, where {:?} of {:?} belong; {EXPORT_ANEW}",
                wanted.shape, wanted.components
            ));
        }
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        if let Some(needed) = wanted.count
            && needed != count
        {
            return Err(format!(
                "it has {count} elements, where {needed} belong; {EXPORT_ANEW}"
            ));
        }
        let width = shape.multiplicity();
        let size = width * component.size();
        let mut numbers = match accessor.buffer_view {
            Some(view) => {
                let rows = self.rows(view, accessor.byte_offset, count, size)?;
                rows.flat_map(|row| row.chunks_exact(component.size()))
                    .map(|bytes| number(bytes, component))
                    .collect()
            }
            // Zeros. Nothing in the file then bounds their number, unless who asks knows it.
            None if accessor.sparse.is_none() && wanted.count.is_none() => {
                return Err(format!(
                    "it has no buffer view and so no data; {EXPORT_ANEW}"
                ));
            }
            None if wanted.count.is_none()
                && count > self.buffers.iter().map(|b| b.len()).sum() =>
            {
                return Err(format!(
                    "it has {count} elements, more than the file has bytes; {EXPORT_ANEW}"
                ));
            }
            None => vec![0.0; count * width],
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(&mut numbers, sparse, component, width)?;
        }
        // What is never a fraction is an index, whatever the flag says.
        if accessor.normalized && wanted.components.contains(&F32) {
            let most = match component {
                I8 => 127.0,
                U8 => 255.0,
                I16 => 32767.0,
                U16 => 65535.0,
                U32 | F32 => 1.0,
            };
            for v in &mut numbers {
                // glTF 2.0, 3.11: the lowest of a signed type lies below -1.
                *v = if most > 1.0 {
                    (*v / most).max(-1.0)
                } else {
                    *v
                };
            }
        }
        Ok(numbers)
    }

    /// Puts the elements of a sparse accessor into their places.
    fn replace(
        &self,
        numbers: &mut [f64],
        sparse: &Sparse,
        component: ComponentType,
        width: usize,
    ) -> Result<(), String> {
        let Checked::Valid(IndexComponentType(kind)) = sparse.indices.component_type else {
            return Err(format!(
                "its sparse indices have no type of glTF 2.0; {EXPORT_ANEW}"
            ));
        };
        let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        let places = self.rows(
            sparse.indices.buffer_view,
            Some(sparse.indices.byte_offset),
            count,
            kind.size(),
        )?;
        let values = self.rows(
            sparse.values.buffer_view,
            Some(sparse.values.byte_offset),
            count,
            width * component.size(),
        )?;
        let elements = numbers.len() / width.max(1);
        for (place, value) in places.zip(values) {
            let place = number(place, kind) as usize;
            let target = numbers.chunks_exact_mut(width).nth(place).ok_or_else(|| {
                format!(
                    "its sparse index {place} lies beyond its {elements} elements; {EXPORT_ANEW}"
                )
            })?;
            for (target, bytes) in target.iter_mut().zip(value.chunks_exact(component.size())) {
                *target = number(bytes, component);
            }
        }
        Ok(())
    }

    /// `count` elements of `size` bytes in a buffer view, from `offset` on.
    fn rows(
        &self,
        view: Index<View>,
        offset: Option<USize64>,
        count: usize,
        size: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, String> {
        let number = view.value();
        let missing = |what: &str| format!("there is no {what}; {EXPORT_ANEW}");
        let view = self.root.buffer_views.get(number);
        let view = view.ok_or_else(|| missing(&format!("buffer view {number}")))?;
        let buffer = self.buffers.get(view.buffer.value());
        let buffer = buffer.ok_or_else(|| missing(&format!("buffer {}", view.buffer)))?;
        let start = view.byte_offset.unwrap_or_default().0;
        let bytes = range(buffer, start, view.byte_length.0).ok_or_else(|| {
            format!(
                "buffer view {number} ends beyond the {} bytes of buffer {}; {EXPORT_ANEW}",
                buffer.len(),
                view.buffer
            )
        })?;
        let stride = match view.byte_stride {
            Some(stride) if stride.0 != 0 => stride.0,
            _ => size,
        };
        if stride < size {
            return Err(format!(
                "elements of {size} bytes overlap in buffer view {number}, whose stride is {stride}; {EXPORT_ANEW}"
            ));
        }
        let extent = match count.checked_sub(1) {
            None => Some(0),
            Some(steps) => steps.checked_mul(stride).and_then(|s| s.checked_add(size)),
        };
        let offset = offset.unwrap_or_default().0;
        let bytes = extent
            .and_then(|extent| range(bytes, offset, extent as u64))
            .ok_or_else(|| {
                format!(
                    "its {count} elements end beyond the {} bytes of buffer view {number}; {EXPORT_ANEW}",
                    bytes.len()
                )
            })?;
        Ok(bytes.chunks(stride).map(move |row| &row[..size]))
    }
}

fn range(bytes: &[u8], start: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(start).ok()?;
    let end = start.checked_add(usize::try_from(length).ok()?)?;
    bytes.get(start..end)
}

/// One component from its little-endian bytes, as many as its type has.
fn number(bytes: &[u8], component: ComponentType) -> f64 {
    match (component, bytes) {
        (I8, &[a]) => i8::from_le_bytes([a]).into(),
        (U8, &[a]) => a.into(),
        (I16, &[a, b]) => i16::from_le_bytes([a, b]).into(),
        (U16, &[a, b]) => u16::from_le_bytes([a, b]).into(),
        (U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).into(),
        (F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).into(),
        // Rows are cut by the size of their components.
        _ => 0.0,
    }
}
