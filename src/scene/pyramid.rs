//! Where the levels of the light map's pyramid lie in one image.
//!
//! Level k halves level k-1: it has max(1, n_0 >> k) texels along an axis of n_0, and texel i of it
//! spans texels [2^k i, 2^k (i + 1)) of level 0, counted from the map's corner. So texel i of level
//! k+1 is centred between texels 2i and 2i+1 of level k, and takes 2i-1, 2i, 2i+1 and 2i+2 by the
//! weights 1/8, 3/8, 3/8 and 1/8.
//!
//! A level's *interior* is those texels. What lies in it spreads beyond: the pyramid's by one texel
//! on each side, its smoothing's by more, of which two texels on each side are kept, and one more on
//! the high side for what an odd size leaves over. That is the level's *content*, from
//! [`CONTENT_LOW`] texels before the interior to [`CONTENT_HIGH`] after it. Level 0 keeps its
//! interior only: the light map has empty texels of its own at its rim
//! ([`super::light::LIGHT_MAP_PAD`]).
//!
//! All else must be 0, since taps beyond a level read it. So each level from 1 on owns [`MARGIN`]
//! texels on each side, twice that lie between two interiors, and nothing ever writes those outside
//! the content: the images are cleared once, when they are made, and never discarded. Level 0 lies at
//! the image's corner, where the border of the sampler, also 0, does this on its low sides.

/// Texels of content before an interior, from level 1 on.
pub const CONTENT_LOW: u32 = 2;
/// Texels of content after an interior, from level 1 on.
pub const CONTENT_HIGH: u32 = 3;
/// Texels on each side of an interior that belong to its level.
pub const MARGIN: u32 = 4;

/// A rectangle of texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Its first column and row.
    pub origin: [u32; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

/// Where the levels of a pyramid lie in one image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Atlas {
    /// Columns and rows of the image.
    pub size: [u32; 2],
    /// The interior of each level.
    pub places: Vec<Place>,
}

/// Texels of level `level` over a base of `base`.
pub fn level_size(base: [u32; 2], level: u32) -> [u32; 2] {
    base.map(|n| n.checked_shr(level).unwrap_or(0).max(1))
}

impl Atlas {
    /// Lays out levels 0 to `levels` - 1 over a base of `base` texels; there is always level 0.
    ///
    /// Level 0 lies at the corner, level 1 in a column of its own at its right, the others stacked
    /// in a column right of that. Where both sides of the base are powers of two, so are those of
    /// the image: then normalised coordinates of texels are exact in floating point.
    pub fn new(base: [u32; 2], levels: u32) -> Atlas {
        let [width, height] = base;
        let mut places = vec![Place {
            origin: [0, 0],
            size: base,
        }];
        let mut corner = [width + 2 * MARGIN, MARGIN];
        for level in 1..levels {
            let size = level_size(base, level);
            places.push(Place {
                origin: corner,
                size,
            });
            match level {
                1 => corner[0] += size[0] + 2 * MARGIN,
                _ => corner[1] += size[1] + 2 * MARGIN,
            }
        }
        let mut size = [0, 1].map(|axis| {
            let ends = places[1..]
                .iter()
                .map(|p| p.origin[axis] + p.size[axis] + MARGIN);
            ends.fold(base[axis], u32::max)
        });
        if levels > 1 && width.is_power_of_two() && height.is_power_of_two() {
            size = size.map(u32::next_power_of_two);
        }
        Atlas { size, places }
    }

    /// Number of levels, level 0 included.
    pub fn levels(&self) -> u32 {
        self.places.len() as u32
    }

    /// What may differ from 0 in level `level`.
    pub fn content(&self, level: u32) -> Place {
        if level == 0 {
            return self.places[0];
        }
        self.grown(level, CONTENT_LOW, CONTENT_HIGH)
    }

    /// The interior of level `level`, from 1 on, with `low` texels before and `high` after it.
    pub fn grown(&self, level: u32, low: u32, high: u32) -> Place {
        let Place { origin, size } = self.places[level as usize];
        Place {
            origin: origin.map(|o| o - low),
            size: size.map(|n| n + low + high),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(place: Place) -> [u32; 2] {
        [0, 1].map(|axis| place.origin[axis] + place.size[axis])
    }

    fn overlap(a: Place, b: Place) -> bool {
        (0..2).all(|axis| a.origin[axis] < ends(b)[axis] && b.origin[axis] < ends(a)[axis])
    }

    /// What a level owns: with margins, and for level 0 those at its right.
    fn owned(atlas: &Atlas, level: u32) -> Place {
        match level {
            0 => Place {
                origin: [0, 0],
                size: [atlas.places[0].size[0] + MARGIN, atlas.places[0].size[1]],
            },
            _ => atlas.grown(level, MARGIN, MARGIN),
        }
    }

    #[test]
    fn levels_keep_their_distance_and_stay_inside() {
        for base in [
            [1, 1],
            [1, 7],
            [7, 1],
            [1, 64],
            [37, 53],
            [128, 32],
            [32, 128],
            [300, 300],
            [512, 512],
            [513, 511],
            [1000, 3],
            [8192, 8192],
        ] {
            for levels in 1..=14 {
                let atlas = Atlas::new(base, levels);
                assert_eq!(atlas.levels(), levels);
                assert_eq!(
                    atlas.places[0],
                    Place {
                        origin: [0, 0],
                        size: base
                    }
                );
                for a in 0..levels {
                    assert_eq!(atlas.places[a as usize].size, level_size(base, a));
                    let margins = owned(&atlas, a);
                    let content = atlas.content(a);
                    for axis in 0..2 {
                        let inside = if a == 0 {
                            ends(content)[axis]
                        } else {
                            ends(margins)[axis]
                        };
                        assert!(
                            inside <= atlas.size[axis],
                            "{base:?}, level {a} of {levels}"
                        );
                        assert!(margins.origin[axis] <= content.origin[axis]);
                        assert!(ends(content)[axis] <= ends(margins)[axis]);
                    }
                    for b in 0..a {
                        assert!(
                            !overlap(margins, owned(&atlas, b)),
                            "{base:?}: levels {a} and {b} of {levels}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_single_level_is_the_base() {
        for base in [[1, 1], [300, 200], [512, 512]] {
            assert_eq!(Atlas::new(base, 1).size, base);
        }
    }

    #[test]
    fn powers_of_two_stay_powers_of_two() {
        assert_eq!(Atlas::new([512, 512], 10).size, [1024, 512]);
        assert_eq!(Atlas::new([8192, 8192], 14).size, [16384, 8192]);
        for levels in 2..10 {
            let size = Atlas::new([128, 32], levels).size;
            assert!(size.iter().all(|n| n.is_power_of_two()), "{size:?}");
        }
    }

    #[test]
    fn sizes_halve_and_end_at_one() {
        assert_eq!(level_size([300, 5], 2), [75, 1]);
        assert_eq!(level_size([300, 5], 8), [1, 1]);
        assert_eq!(level_size([300, 5], 40), [1, 1]);
    }
}
