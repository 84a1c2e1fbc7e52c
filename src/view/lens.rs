//! What is looked at: the picture, or what it is made of, drawn by pure functions.

use super::region::Region;
use super::worker::Fetches;
use crate::frame::Target;
use crate::frame::uniforms::LIGHT_DEPTH_MARGIN;
use crate::report::heatmap;
use crate::scene::pyramid::{Atlas, Place};
use crate::scene::{LightFrame, Multiple, Plan, Taps};
use std::ops::RangeInclusive;

/// What nothing covers: a colour that no scale contains.
pub const UNCOVERED: [u8; 4] = [27, 33, 41, 255];

/// The share of errors that their scale spans, as on the maps of `marmor compare`.
const SPAN: f64 = 0.999;

/// What is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lens {
    /// The picture itself.
    #[default]
    Picture,
    /// How far from the light its map is.
    LightDepth,
    /// The moments of that depth.
    Moments(Moments),
    /// A slice of a volume of light.
    Volumes(Slice),
    /// How often each pixel reads textures.
    Fetches,
    /// The error against exact of a region.
    Error,
}

/// Which moment of which level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moments {
    /// k of w z^k, in [0, 4].
    pub power: u32,
    /// 0 is the light map, each other half as large as the one before.
    pub level: u32,
    /// Whether the level is smoothed, as the mixture reads it.
    pub smoothed: bool,
}

/// Which slice of which volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slice {
    /// 0 is the finest.
    pub volume: u32,
    /// 0 is nearest to the light.
    pub slice: u32,
}

impl Lens {
    /// The next one, of those that `offer` has; after the last the picture again.
    #[must_use]
    pub fn next(self, offer: &Offer) -> Lens {
        let all = offer.lenses();
        let own = all.iter().position(|lens| lens.name() == self.name());
        all[own.map_or(0, |own| (own + 1) % all.len())]
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Lens::Picture => "picture",
            Lens::LightDepth => "light depth",
            Lens::Moments(_) => "light moments",
            Lens::Volumes(_) => "light volumes",
            Lens::Fetches => "fetches",
            Lens::Error => "error against exact",
        }
    }

    /// The image that it shows, if it shows one of the frame's own.
    pub fn target(self) -> Option<Target> {
        Some(match self {
            Lens::LightDepth => Target::LightDepth,
            Lens::Moments(moments) => match (moments.power, moments.smoothed) {
                (4.., false) => Target::FourthPyramid,
                (4.., true) => Target::FourthSmoothed,
                (_, false) => Target::LightPyramid,
                (_, true) => Target::LightSmoothed,
            },
            Lens::Volumes(_) => Target::Volumes,
            Lens::Picture | Lens::Fetches | Lens::Error => return None,
        })
    }

    /// The same, with nothing that `offer` lacks.
    #[must_use]
    pub fn within(self, offer: &Offer) -> Lens {
        match self {
            Lens::Moments(mut moments) => {
                moments.power = moments
                    .power
                    .min(if offer.fourth.is_some() { 4 } else { 3 });
                moments.level = moments.level.min(offer.levels - 1);
                moments.smoothed &= offer.is_smoothed(moments.power, moments.level);
                Lens::Moments(moments)
            }
            Lens::Volumes(Slice { volume, slice }) => {
                let volume = volume.min(offer.slices.len().saturating_sub(1) as u32);
                match offer.slices.get(volume as usize) {
                    None => Lens::Picture,
                    Some(slices) => Lens::Volumes(Slice {
                        volume,
                        slice: slice.min(slices - 1),
                    }),
                }
            }
            lens => lens,
        }
    }
}

/// What a plan has that can be looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Offer {
    /// Levels of the moments, that of the map included.
    pub levels: u32,
    /// Those that are smoothed, if any are.
    pub smoothed: Option<RangeInclusive<u32>>,
    /// Those of the fourth moment that are smoothed, if there is one.
    pub fourth: Option<RangeInclusive<u32>>,
    /// Slices of each volume.
    pub slices: Vec<u32>,
}

impl Offer {
    /// That of `plan`.
    pub fn of(plan: &Plan) -> Offer {
        let frame = plan.light_frame();
        let Some(taps) = taps(plan, &frame) else {
            return Offer {
                levels: 1,
                smoothed: None,
                fourth: None,
                slices: Vec::new(),
            };
        };
        let smoothed = taps.span(0..taps.moments());
        let volumes = taps.volumes.iter();
        let slices = volumes.flat_map(|all| {
            let slices = |volume: &crate::scene::volume::Volume| all.grids[volume.grid].size[2];
            all.volumes.iter().map(slices)
        });
        Offer {
            levels: smoothed.end() + 1,
            slices: slices.collect(),
            fourth: (!taps.fourth.is_empty()).then(|| taps.span(taps.fourth.clone())),
            smoothed: Some(smoothed),
        }
    }

    /// All that can be looked at, each as it is at first.
    pub fn lenses(&self) -> Vec<Lens> {
        let mut all = vec![
            Lens::Picture,
            Lens::LightDepth,
            Lens::Moments(Moments::default()),
        ];
        if let Some(slices) = self.slices.first() {
            all.push(Lens::Volumes(Slice {
                volume: 0,
                slice: slices / 2,
            }));
        }
        all.extend([Lens::Fetches, Lens::Error]);
        all
    }

    /// Whether level `level` of the moment of `power` is smoothed.
    pub fn is_smoothed(&self, power: u32, level: u32) -> bool {
        let levels = if power > 3 {
            &self.fourth
        } else {
            &self.smoothed
        };
        levels
            .as_ref()
            .is_some_and(|levels| levels.contains(&level))
    }
}

/// What the first mixture of `plan`, if it has one, taps.
fn taps(plan: &Plan, frame: &LightFrame) -> Option<Taps> {
    plan.methods().find_map(|method| match method {
        Multiple::Mixture(mixture) => Some(plan.taps(mixture, frame)),
        _ => None,
    })
}

/// Which colours stand for values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colors {
    /// White is low, and near.
    Near,
    /// Black is low.
    Grey,
    /// From dark to bright: what counts up from nothing.
    Magma,
    /// Blue below zero, red above: what has a sign.
    Signed,
}

impl Colors {
    /// 256 colours, from low to high.
    pub fn all(self) -> Vec<[u8; 4]> {
        let grey = |at: i32| [at as u8, at as u8, at as u8, 255];
        match self {
            // Neither end is as dark as what is not covered.
            Colors::Near => (0..256).map(|at| grey(250 - at * 190 / 255)).collect(),
            Colors::Grey => (0..256).map(|at| grey(12 + at * 243 / 255)).collect(),
            Colors::Magma => heatmap::magma(),
            Colors::Signed => (0..256)
                .map(|at| signed(f64::from(at) / 127.5 - 1.0))
                .collect(),
        }
    }
}

/// A colour of the diverging scale, for x in [-1, 1].
fn signed(x: f64) -> [u8; 4] {
    const STOPS: [[f64; 3]; 3] = [
        [38.0, 92.0, 168.0],
        [236.0, 233.0, 228.0],
        [188.0, 62.0, 36.0],
    ];
    let end = if x < 0.0 { STOPS[0] } else { STOPS[2] };
    let mut color = [255; 4];
    for (channel, value) in color.iter_mut().take(3).enumerate() {
        let middle = STOPS[1][channel];
        *value = (middle + x.abs().min(1.0) * (end[channel] - middle)).round() as u8;
    }
    color
}

/// Colours, and what they stand for.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// The colours.
    pub colors: Colors,
    /// What the first and the last stand for.
    pub ends: [String; 2],
}

/// What an image shows, in words.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// Its name.
    pub title: String,
    /// More of it: size, texel, what was measured.
    pub facts: Vec<String>,
    /// What its colours mean.
    pub scale: Option<Scale>,
    /// Whether the facts tell of something wrong.
    pub wrong: bool,
}

/// An image to look at.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Width and height, texels.
    pub size: [u32; 2],
    /// sRGB, row-major.
    pub pixels: Vec<[u8; 4]>,
    /// What it is.
    pub legend: Legend,
}

/// Paints `values`, row-major, on a scale from `low` to `high`; none is what nothing covers.
pub fn paint(values: &[Option<f64>], [low, high]: [f64; 2], colors: Colors) -> Vec<[u8; 4]> {
    let all = colors.all();
    let color = |value: f64| {
        // Where all values are alike the scale has no length.
        let share = if high > low {
            (value - low) / (high - low)
        } else {
            0.0
        };
        let index = (share.clamp(0.0, 1.0) * 255.0).round() as usize;
        all.get(index).copied().unwrap_or(UNCOVERED)
    };
    let painted = values.iter().map(|value| value.map_or(UNCOVERED, color));
    painted.collect()
}

/// The least and the largest of `values`; 0 where there are none.
fn range(values: &[Option<f64>]) -> [f64; 2] {
    let given = values.iter().copied().flatten();
    let found = given.fold(None, |found: Option<[f64; 2]>, value| {
        let [low, high] = found.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    });
    found.unwrap_or([0.0; 2])
}

/// The texels of `place` in an image of `columns`, row-major.
pub fn cut<T: Copy>(texels: &[T], columns: u32, place: Place) -> Vec<T> {
    let [x, y] = place.origin.map(|side| side as usize);
    let [width, height] = place.size.map(|side| side as usize);
    let rows = texels
        .chunks_exact(columns.max(1) as usize)
        .skip(y)
        .take(height);
    let cut = rows.flat_map(|row| row.iter().skip(x).take(width));
    cut.copied().collect()
}

/// An image of the frame that drew `plan`, which `lens` looks at, as its texels were read; none where the lens shows none
/// of them, or the plan has not what it shows.
pub fn shown(lens: Lens, plan: &Plan, texels: &[[f32; 4]]) -> Option<Shown> {
    let frame = plan.light_frame();
    match lens {
        Lens::LightDepth => Some(depth(&frame, texels)),
        Lens::Moments(which) => moments(which, plan, &frame, texels),
        Lens::Volumes(which) => volume(which, plan, &frame, texels),
        Lens::Picture | Lens::Fetches | Lens::Error => None,
    }
}

fn depth(frame: &LightFrame, texels: &[[f32; 4]]) -> Shown {
    // Nothing lies at the far plane: the caster's range keeps a margin to it.
    let values = texels
        .iter()
        .map(|texel| (texel[0] < 1.0).then_some(f64::from(texel[0])));
    let values: Vec<_> = values.collect();
    let [near, far] = range(&values);
    let deep = (far - near) * 2.0 * frame.z_half * LIGHT_DEPTH_MARGIN;
    Shown {
        size: [frame.size; 2],
        pixels: paint(&values, [near, far], Colors::Near),
        legend: Legend {
            title: "light depth".to_owned(),
            facts: vec![texel_words([frame.size; 2], frame.texel)],
            scale: Some(Scale {
                colors: Colors::Near,
                ends: ["nearest".to_owned(), format!("{deep:.2} mm behind it")],
            }),
            wrong: false,
        },
    }
}

fn texel_words([width, height]: [u32; 2], texel: f64) -> String {
    format!("{width} × {height} texels of {texel:.3} mm")
}

/// w z^k, as one writes it.
pub fn moment_name(power: u32) -> &'static str {
    ["w", "w z", "w z²", "w z³", "w z⁴"][power.min(4) as usize]
}

fn moments(which: Moments, plan: &Plan, frame: &LightFrame, texels: &[[f32; 4]]) -> Option<Shown> {
    let Moments {
        power,
        level,
        smoothed,
    } = which;
    let taps = taps(plan, frame);
    let levels = taps.map_or(1, |taps| taps.level(taps.moments() - 1) + 1);
    let atlas = Atlas::new([plan.light_map; 2], levels);
    let place = *atlas.places.get(level as usize)?;
    if texels.len() != atlas.size[0] as usize * atlas.size[1] as usize {
        return None;
    }
    let component = if power > 3 { 0 } else { power as usize };
    let values = cut(texels, atlas.size[0], place).into_iter().map(|texel| {
        // The fourth moment has an image of its own, without w.
        (texel[0] != 0.0).then_some(f64::from(texel[component]))
    });
    let values: Vec<_> = values.collect();
    let [low, high] = range(&values);
    let largest = low.abs().max(high.abs());
    let (colors, ends) = match power {
        0 => (Colors::Grey, [0.0, high]),
        1 | 3 => (Colors::Signed, [-largest, largest]),
        _ => (Colors::Magma, [0.0, high]),
    };
    let how = if smoothed { ", smoothed" } else { "" };
    let texel = frame.texel * f64::from(level).exp2();
    Some(Shown {
        size: place.size,
        pixels: paint(&values, ends, colors),
        legend: Legend {
            title: format!("{}   level {level}{how}", moment_name(power)),
            facts: vec![texel_words(place.size, texel)],
            scale: Some(Scale {
                colors,
                ends: ends.map(number),
            }),
            wrong: false,
        },
    })
}

fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        x if (0.01..1e4).contains(&x) => format!("{value:.3}"),
        _ => format!("{value:.1e}"),
    }
}

fn volume(which: Slice, plan: &Plan, frame: &LightFrame, texels: &[[f32; 4]]) -> Option<Shown> {
    let volumes = taps(plan, frame)?.volumes?;
    let volume = volumes.volumes.get(which.volume as usize)?;
    let grid = &volumes.grids[volume.grid];
    let [columns, rows, _] = volumes.image;
    let [x, y, first] = volume.origin;
    let [width, height, slices] = grid.size;
    if which.slice >= slices {
        return None;
    }
    let slice = (columns * rows) as usize;
    let image = texels
        .chunks_exact(slice)
        .nth((first + which.slice) as usize)?;
    let place = Place {
        origin: [x, y],
        size: [width, height],
    };
    let values = cut(image, columns, place).into_iter();
    let values: Vec<_> = values
        .map(|cell| (cell[0] > 0.0).then_some(f64::from(cell[0]) * volume.factor))
        .collect();
    // One scale for all slices, lest each be as bright as the next.
    let all = texels
        .chunks_exact(slice)
        .skip(first as usize)
        .take(slices as usize);
    let all = all.flat_map(|image| cut(image, columns, place));
    let most = all.fold(0.0_f64, |most, cell| {
        most.max(f64::from(cell[0]) * volume.factor)
    });
    let cell = frame.texel / grid.scale;
    let Slice { volume, slice } = which;
    Some(Shown {
        size: [width, height],
        pixels: paint(&values, [0.0, most], Colors::Magma),
        legend: Legend {
            title: format!("volume {volume}   slice {slice} of {slices}"),
            facts: vec![format!(
                "{width} × {height} × {slices} cells of {cell:.3} mm"
            )],
            scale: Some(Scale {
                colors: Colors::Magma,
                ends: ["0".to_owned(), number(most)],
            }),
            wrong: false,
        },
    })
}

/// What each pixel has read, from none to what is declared or, where one reads more, the most.
pub fn fetches(fetches: &Fetches) -> Shown {
    let ledger = &fetches.ledger;
    let values = ledger.pixels.iter();
    let values: Vec<_> = values.map(|&n| (n > 0).then_some(f64::from(n))).collect();
    let read = values.iter().copied().flatten();
    let mean = read.clone().sum::<f64>() / read.count().max(1) as f64;
    let (declared, most) = (ledger.declared(), ledger.most().unwrap_or(0));
    let high = declared.max(f64::from(most));
    let differ = ledger.disagreements();
    let mut facts = vec![format!(
        "declared {declared}   mean {mean:.2}   most {most}"
    )];
    facts.push(match differ.as_slice() {
        [] => "declared, found in SPIR-V and measured agree".to_owned(),
        [first, ..] => first.clone(),
    });
    Shown {
        size: fetches.size,
        pixels: paint(&values, [0.0, high], Colors::Magma),
        legend: Legend {
            title: format!("fetches a pixel   {}", fetches.method),
            facts,
            scale: Some(Scale {
                colors: Colors::Magma,
                ends: ["0".to_owned(), format!("{high}")],
            }),
            wrong: !differ.is_empty(),
        },
    }
}

/// The error of each pixel of a region, from none to that which all but a thousandth keep to.
pub fn error(region: &Region) -> Shown {
    let [_, _, width, height] = region.place;
    let mut sorted: Vec<f64> = region.errors.iter().copied().flatten().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    let high = sorted.get((SPAN * last as f64).ceil() as usize);
    let high = high.copied().unwrap_or(0.0);
    let seconds = region.time.as_secs_f64();
    Shown {
        size: [width, height],
        pixels: paint(&region.errors, [0.0, high], Colors::Magma),
        legend: Legend {
            title: format!("error against exact   {}", region.method),
            facts: vec![
                format!(
                    "rr {:.4}   largest {:.3}",
                    region.rr,
                    sorted.last().unwrap_or(&0.0)
                ),
                format!("{width} × {height} pixels in {seconds:.1} s"),
            ],
            scale: Some(Scale {
                colors: Colors::Magma,
                ends: ["0".to_owned(), number(high)],
            }),
            wrong: false,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Method, Request};

    fn plan(method: Method, volumes: u32, moments: u32) -> Plan {
        let mut request = Request::statue();
        (request.multiple, request.light_map) = (method, 64);
        (request.volumes, request.moments) = (volumes, moments);
        request.plan().expect("a plan")
    }

    #[test]
    fn scales_run_from_end_to_end_and_uncovered_is_on_none() {
        let values = [Some(-2.0), Some(0.0), Some(2.0), None];
        for colors in [Colors::Near, Colors::Grey, Colors::Magma, Colors::Signed] {
            let all = colors.all();
            assert_eq!(all.len(), 256);
            assert!(!all.contains(&UNCOVERED), "{colors:?}");
            let painted = paint(&values, [-2.0, 2.0], colors);
            assert_eq!(
                painted,
                [all[0], all[128], all[255], UNCOVERED],
                "{colors:?}"
            );
        }
        // What has a sign is neutral at zero, blue below it and red above.
        let [low, _, high] = [-1.0, 0.0, 1.0].map(signed);
        assert!(low[2] > low[0] && high[0] > high[2]);
        let [r, g, b, _] = signed(0.0);
        assert!(r.abs_diff(g) < 12 && g.abs_diff(b) < 12);
        // Values that are all alike do not divide by nothing.
        assert_eq!(
            paint(&[Some(3.0)], [3.0; 2], Colors::Grey),
            [Colors::Grey.all()[0]]
        );
    }

    #[test]
    fn levels_are_cut_out_of_their_atlas() {
        let plan = plan(Method::Mixture, 0, 3);
        let offer = Offer::of(&plan);
        assert!(offer.slices.is_empty() && offer.fourth.is_none());
        assert!(offer.levels > 1, "{offer:?}");
        let atlas = Atlas::new([64; 2], offer.levels);
        // Each texel has the number of its level, and beside them is nothing.
        let mut texels = vec![[0.0; 4]; (atlas.size[0] * atlas.size[1]) as usize];
        for (level, place) in atlas.places.iter().enumerate() {
            for y in place.origin[1]..place.origin[1] + place.size[1] {
                for x in place.origin[0]..place.origin[0] + place.size[0] {
                    let number = level as f32 + 1.0;
                    texels[(y * atlas.size[0] + x) as usize] = [number, -number, number, 0.0];
                }
            }
        }
        for level in 0..offer.levels {
            let which = |power| {
                Lens::Moments(Moments {
                    power,
                    level,
                    smoothed: false,
                })
            };
            let shown = |power| shown(which(power), &plan, &texels).expect("a level");
            let w = shown(0);
            assert_eq!(w.size, [64 >> level; 2]);
            assert_eq!(w.pixels.len(), (64 >> level) * (64 >> level));
            assert!(
                w.pixels
                    .iter()
                    .all(|pixel| *pixel == Colors::Grey.all()[255])
            );
            let ends = w.legend.scale.expect("a scale").ends;
            assert_eq!(ends[1], format!("{}.000", level + 1));
            // A mean that is negative lies at the blue end.
            assert!(shown(1).pixels.iter().all(|pixel| *pixel == signed(-1.0)));
            assert!(
                shown(2)
                    .pixels
                    .iter()
                    .all(|pixel| *pixel == Colors::Magma.all()[255])
            );
        }
        let beyond = Lens::Moments(Moments {
            power: 4,
            level: 99,
            smoothed: true,
        });
        assert_eq!(shown(beyond, &plan, &texels), None);
        let Lens::Moments(within) = beyond.within(&offer) else {
            panic!("another lens");
        };
        assert_eq!((within.power, within.level), (3, offer.levels - 1));
        assert_eq!(within.smoothed, offer.is_smoothed(3, within.level));
        // Texels of another image are none of this plan.
        assert_eq!(
            shown(Lens::Moments(Moments::default()), &plan, &texels[1..]),
            None
        );
    }

    #[test]
    fn depth_runs_over_what_is_covered() {
        let plan = plan(Method::Brdf, 0, 3);
        let mut texels = vec![[1.0, 0.0, 0.0, 0.0]; 64 * 64];
        (texels[0][0], texels[1][0], texels[2][0]) = (0.25, 0.5, 0.75);
        let depth = shown(Lens::LightDepth, &plan, &texels).expect("depth");
        let all = Colors::Near.all();
        assert_eq!(depth.pixels[..4], [all[0], all[128], all[255], UNCOVERED]);
        // Half of the range of the clip space.
        let deep = plan.light_frame().z_half * LIGHT_DEPTH_MARGIN;
        let ends = depth.legend.scale.expect("a scale").ends;
        assert!(ends[1].starts_with(&format!("{deep:.2} mm")), "{ends:?}");
        assert_eq!(Offer::of(&plan).levels, 1);
    }

    #[test]
    fn slices_are_cut_out_of_their_volume() {
        let plan = plan(Method::Mixture, 3, 4);
        let offer = Offer::of(&plan);
        assert!(offer.slices.len() > 1, "{offer:?}");
        let volumes = taps(&plan, &plan.light_frame()).and_then(|taps| taps.volumes);
        let volumes = volumes.expect("volumes");
        let [columns, rows, depth] = volumes.image;
        let mut texels = vec![[0.0; 4]; (columns * rows * depth) as usize];
        let volume = &volumes.volumes[1];
        let [x, y, z] = volume.origin;
        let last = offer.slices[1] - 1;
        let at = |slice: u32| (((z + slice) * rows + y) * columns + x) as usize;
        (texels[at(0)][0], texels[at(last)][0]) = (1.0, 2.0);
        let slice = |slice| {
            let lens = Lens::Volumes(Slice { volume: 1, slice });
            shown(lens, &plan, &texels).expect("a slice")
        };
        let magma = Colors::Magma.all();
        assert_eq!(slice(0).pixels[..2], [magma[128], UNCOVERED]);
        assert_eq!(slice(last).pixels[..2], [magma[255], UNCOVERED]);
        let [width, height, _] = volumes.grids[volume.grid].size;
        assert_eq!(slice(0).size, [width, height]);
        assert_eq!(slice(0).pixels.len(), (width * height) as usize);
    }

    #[test]
    fn one_goes_through_all_of_them() {
        for (plan, count) in [
            (plan(Method::Mixture, 3, 4), 6),
            (plan(Method::Samples, 0, 3), 5),
        ] {
            let offer = Offer::of(&plan);
            let mut lens = Lens::Picture;
            let mut seen = Vec::new();
            for _ in 0..count {
                seen.push(lens.name());
                lens = lens.next(&offer);
                assert_eq!(lens.within(&offer), lens);
            }
            assert_eq!(lens, Lens::Picture);
            assert_eq!(seen.len(), count);
            seen.dedup();
            assert_eq!(seen.len(), count);
        }
        // Of a volume that is gone one sees the picture.
        let none = Offer::of(&plan(Method::Brdf, 0, 3));
        assert_eq!(Lens::Volumes(Slice::default()).within(&none), Lens::Picture);
    }

    #[test]
    fn a_region_is_scaled_by_all_but_its_fireflies() {
        let mut errors: Vec<_> = (0..1999).map(|at| Some(f64::from(at) / 1e4)).collect();
        errors.push(Some(50.0));
        errors[0] = None;
        let region = Region {
            place: [3, 4, 50, 40],
            method: "samples(8)".to_owned(),
            errors,
            rr: 0.25,
            time: std::time::Duration::from_millis(1500),
        };
        let shown = error(&region);
        assert_eq!((shown.size, shown.pixels.len()), ([50, 40], 2000));
        assert_eq!(shown.pixels[0], UNCOVERED);
        let magma = Colors::Magma.all();
        assert_eq!(shown.pixels[1999], magma[255]);
        // The largest but two is bright, too.
        assert!(shown.pixels[1998] == magma[255] && shown.pixels[1000] != magma[255]);
        assert_eq!(shown.legend.facts[0], "rr 0.2500   largest 50.000");
    }
}
