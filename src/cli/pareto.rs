//! `marmor bench --pareto`: the error of every plan that a fetch budget may choose, measured.
//!
//! Radiance adds up, so each way of either kind of scattering is drawn once a scene and material, and the error of any
//! two together follows from their differences to the references: with d and e those of multiple and of single
//! scattering, the mean of (d + e)^2 is that of d^2 + 2de + e^2.

use super::Global;
use super::failure::Failure;
use super::progress::Bar;
use crate::cpu::traced;
use crate::frame::{self, Renderer, Setup};
use crate::ledger::Filter;
use crate::ledger::budget::{COLUMNS, Choice, Counter, Row};
use crate::report::{self, Output, compare};
use crate::scene::{
    Exits, Fourth, Jitter, March, Material, Mesh, Mixture, Multiple, Plan, Request, Single,
    Viewpoint, preset,
};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::io::Write as _;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// The materials: one that is clear and bright, one that absorbs, one that is dense, one that is dark and red.
const MATERIALS: [&str; 4] = ["marble", "skin1", "wholemilk", "ketchup"];

/// Object, light and camera (azimuth and elevation, degrees), and the size of the picture.
type Scene = (Object, [f64; 2], [f64; 2], [u32; 2]);

/// The statue in three lights, among them one from behind; a sphere, and a thin disc lit from behind, whose pictures are
/// smaller, since they show less.
const SCENES: [Scene; 5] = [
    (Object::Statue, [40.0, 35.0], [-28.0, 4.0], [200, 150]),
    (Object::Statue, [-28.0, 20.0], [-28.0, 4.0], [200, 150]),
    (Object::Statue, [-140.0, 35.0], [-28.0, 4.0], [200, 150]),
    (Object::Sphere, [40.0, 35.0], [-28.0, 4.0], [100, 75]),
    (Object::Disc, [170.0, 10.0], [0.0, 0.0], [100, 75]),
];

/// Light maps for which a plan is kept if it is the best of its fetches there.
const LIGHT_MAPS: [u32; 4] = [256, 512, 1024, 2048];

/// How much longer than a plan's picture do its two references take, about? For the time left alone.
const EXACT_WORK: u64 = 30;
const TRACED_WORK: u64 = 15;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Object {
    Statue,
    /// Of radius 20 mm.
    Sphere,
    /// Of that radius, 2 mm thick, facing +Z.
    Disc,
}

/// Measures, and writes the table of plans to `out`.
pub(super) fn run(global: &Global, out: &Path) -> Result<(), Failure> {
    let output = Output::check(out)?;
    let (multiples, singles) = (multiples(), singles());
    let device = frame::open_device(&global.options())?;
    let mut bar = Bar::new(global.quiet);
    let pairs = MATERIALS.len() * SCENES.len();
    let pictures = multiples.len() + singles.len();
    let of = pairs as u64 * (EXACT_WORK + TRACED_WORK + pictures as u64);
    let mut done = 0;
    let mut step = |work| {
        done += work;
        bar.report_pictures(done, of);
    };
    let draw = |plan: &Plan| -> Result<Vec<[f32; 4]>, Failure> {
        let fault = |error| Failure::from(frame::Error::from(error));
        let mut renderer = Renderer::new(&device, plan, &Setup::default()).map_err(fault)?;
        renderer.render(&mut |_| ()).map_err(fault)?;
        renderer.radiance().map_err(fault)
    };
    // The error of each combination in each pair: [multiple][single] is a list over pairs.
    let mut errors = vec![vec![Vec::with_capacity(pairs); singles.len()]; multiples.len()];
    for material in MATERIALS {
        for scene in &SCENES {
            let mut plan = plan(scene, material)?;
            let mut alone = |multiple, single| {
                Choice { multiple, single }.apply(&mut plan);
                draw(&plan)
            };
            let exact = alone(Multiple::Exact, Single::Off)?;
            step(EXACT_WORK);
            let mut drawn = Vec::new();
            for multiple in &multiples {
                drawn.push(alone(*multiple, Single::Off)?);
                step(1);
            }
            let mut marched = Vec::new();
            for single in &singles {
                marched.push(alone(Multiple::None, *single)?);
                step(1);
            }
            let traced = traced::picture(&plan, &|| ());
            step(TRACED_WORK);

            let basis = Basis::new(&exact, &traced);
            let multiple: Vec<_> = drawn.iter().map(|p| basis.difference(p, &exact)).collect();
            let traced: Vec<_> = traced.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
            let single: Vec<_> = marched
                .iter()
                .map(|p| basis.difference(p, &traced))
                .collect();
            let squares = |list: &[Vec<f64>]| list.iter().map(|d| dot(d, d)).collect::<Vec<_>>();
            let (of_multiple, of_single) = (squares(&multiple), squares(&single));
            for (m, d) in multiple.iter().enumerate() {
                for (s, e) in single.iter().enumerate() {
                    let sum = of_multiple[m] + 2.0 * dot(d, e) + of_single[s];
                    // Rounding may leave less than nothing.
                    errors[m][s].push((sum / d.len() as f64).max(0.0).sqrt());
                }
            }
            tracing::info!("{:?} lit from {:?} in {material}", scene.0, scene.1);
        }
    }
    bar.clear();

    let statue = Request::statue().plan()?;
    let mut counter = Counter::new(&statue, Filter::Linear);
    let mut rows = Vec::new();
    for (multiple, errors) in multiples.iter().zip(errors) {
        for (single, errors) in singles.iter().zip(errors) {
            let choice = Choice {
                multiple: *multiple,
                single: *single,
            };
            // No transport, no light scattered once; and a black picture is none.
            let allowed = match multiple {
                Multiple::Brdf => *single == Single::Off,
                Multiple::None => *single != Single::Off,
                _ => true,
            };
            if !allowed {
                continue;
            }
            let row = Row {
                choice,
                expected: rounded(errors.iter().sum::<f64>() / errors.len() as f64),
                worst: rounded(errors.iter().copied().fold(0.0, f64::max)),
                fetches: counter.fetches(choice),
            };
            tracing::debug!(
                "{choice}: {} fetches, expected {:.4}, worst {:.4}, each {errors:.4?}",
                row.fetches,
                row.expected,
                row.worst
            );
            rows.push(row);
        }
    }
    let rows = fronts(&rows, &statue)?;
    let candidate = device.candidate();
    let head = format!(
        "# Written by `marmor bench --pareto` on {}; do not edit. docs/budgets.md says how it comes about.\n\
         # Device: {}, {}.\n\
         # expected_rr is the mean, worst_rr the largest, over {} scenes in {}.\n\
         # fetches are those of a pixel of the statue with every default.\n",
        date(),
        candidate.name,
        candidate.driver,
        SCENES.len(),
        MATERIALS.join(", "),
    );
    for message in device.instance().take_messages() {
        tracing::error!("validation: {message}");
    }
    Ok(write(&output, &head, &rows)?)
}

/// Every way of multiple scattering that is drawn.
fn multiples() -> Vec<Multiple> {
    let mut list = vec![Multiple::None, Multiple::Brdf];
    let three = |level_step, volumes| {
        Multiple::Mixture(Mixture {
            level_step,
            volumes,
            ..Mixture::THREE
        })
    };
    let four = |fourth, level_step, volumes| {
        Multiple::Mixture(Mixture {
            fourth,
            level_step,
            volumes,
            ..Mixture::FOUR
        })
    };
    list.extend((0..=5).map(|volumes| three(1, volumes)));
    list.extend((0..=3).map(|volumes| three(2, volumes)));
    list.extend((1..=3).map(|count| four(Fourth::Most(count), 1, 0)));
    list.extend([3, 4].map(|volumes| four(Fourth::Most(2), 1, volumes)));
    list.extend((0..=5).map(|volumes| four(Fourth::From(0), 1, volumes)));
    list.extend([0, 2, 3].map(|volumes| four(Fourth::From(0), 2, volumes)));
    list.extend((2..=10).map(Multiple::Rings));
    list.extend([1, 2, 3, 4, 6, 8, 12, 16, 24, 30, 48].map(Multiple::Samples));
    list
}

/// Every way of single scattering that is drawn.
fn singles() -> Vec<Single> {
    let march = |exits| move |steps| Single::March(March { steps, exits });
    let mut list = vec![Single::Off];
    // Two draw contour lines on smooth skin, which rr hardly sees: no picture to choose for anyone.
    list.extend([3, 4, 6, 8, 12, 16, 24, 32].map(march(Exits::Linear)));
    // They cost what a linear tap does, and can win only where its two depths mislead.
    list.extend([4, 8].map(march(Exits::Nearest)));
    list.extend([4, 8].map(march(Exits::Depth)));
    list
}

/// The plan of one scene, without a method.
fn plan((object, light, camera, size): &Scene, material: &str) -> Result<Plan, Failure> {
    let viewpoint = Viewpoint::Orbit {
        azimuth: camera[0],
        elevation: camera[1],
        distance: None,
        target: None,
    };
    let mut request = Request {
        viewpoint: viewpoint.clone(),
        size: *size,
        material: Material::preset(material).map_err(Failure::Input)?,
        specular: false,
        jitter: Jitter::Off,
        ..Request::statue()
    };
    [request.light.azimuth, request.light.elevation] = *light;
    let mut plan = request.plan()?;
    let mesh = match object {
        Object::Statue => return Ok(plan),
        // From pole to pole: z, radius, and the normal's part along z.
        Object::Sphere => revolved(
            &(0..=64)
                .map(|i| {
                    let angle = PI * f64::from(i) / 64.0;
                    // The sine of pi is not quite 0 in f64, and would leave a hole there.
                    let radius = if i % 64 == 0 { 0.0 } else { 20.0 * angle.sin() };
                    (20.0 * angle.cos(), radius, angle.cos())
                })
                .collect::<Vec<_>>(),
        ),
        // The rim's edges are sharp, so each has two normals.
        Object::Disc => revolved(&[
            (1.0, 0.0, 1.0),
            (1.0, 20.0, 1.0),
            (1.0, 20.0, 0.0),
            (-1.0, 20.0, 0.0),
            (-1.0, 20.0, -1.0),
            (-1.0, 0.0, -1.0),
        ]),
    };
    plan.scene.camera = viewpoint
        .camera(request.fov, request.size, &mesh.positions)
        .map_err(Failure::Input)?;
    plan.scene.mesh = mesh;
    Ok(plan)
}

/// The surface that a profile of (z, radius, z of the unit normal) draws around the z axis, from +z to -z.
fn revolved(profile: &[(f64, f64, f64)]) -> Mesh {
    const SLICES: u32 = 192;
    let mut mesh = Mesh::default();
    for &(z, radius, normal) in profile {
        for slice in 0..SLICES {
            let (sin, cos) = (TAU * f64::from(slice) / f64::from(SLICES)).sin_cos();
            let across = (1.0 - normal * normal).max(0.0).sqrt();
            mesh.positions
                .push(DVec3::new(radius * cos, radius * sin, z));
            mesh.normals
                .push(DVec3::new(across * cos, across * sin, normal));
            mesh.uvs.push([0.0; 2]);
        }
    }
    for ring in 0..profile.len() as u32 - 1 {
        for slice in 0..SLICES {
            let at = |ring: u32, slice: u32| ring * SLICES + slice % SLICES;
            let [a, b] = [at(ring, slice), at(ring, slice + 1)];
            let [c, d] = [at(ring + 1, slice), at(ring + 1, slice + 1)];
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    // At the poles, and between the two normals of an edge.
    mesh.drop_degenerate();
    mesh
}

/// Which pixels count, and what their differences are divided by, as in [`compare`].
struct Basis {
    covered: Vec<usize>,
    scale: [f64; 3],
}

impl Basis {
    /// Of the sum of two references, of which the first knows what is covered.
    fn new(exact: &[[f32; 4]], traced: &[[f32; 3]]) -> Basis {
        let covered: Vec<usize> = (0..exact.len())
            .filter(|&at| compare::is_covered(&exact[at]))
            .collect();
        let mean = |channel: usize| {
            let sum = |at: &usize| f64::from(exact[*at][channel]) + f64::from(traced[*at][channel]);
            covered.iter().map(sum).sum::<f64>() / covered.len().max(1) as f64
        };
        Basis {
            scale: [0, 1, 2].map(mean),
            covered,
        }
    }

    /// The relative differences of all covered pixels, channel after channel.
    fn difference(&self, picture: &[[f32; 4]], reference: &[[f32; 4]]) -> Vec<f64> {
        let pixels = self.covered.iter();
        pixels
            .flat_map(|&at| {
                [0, 1, 2].map(|channel| {
                    let difference =
                        f64::from(picture[at][channel]) - f64::from(reference[at][channel]);
                    difference / self.scale[channel]
                })
            })
            .collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// To what the table says, so that what is kept is what the table's reader would choose.
fn rounded(error: f64) -> f64 {
    (error * 1e4).round() / 1e4
}

/// The rows that some budget chooses somewhere, fewest fetches first: those that no other beats, with no more fetches and
/// no more error, for some preset and light map on the statue or in some of the measured scenes. How many fetches a
/// mixture makes depends on all three, so a plan that loses in marble may win in milk.
fn fronts(rows: &[Row], statue: &Plan) -> Result<Vec<Row>, Failure> {
    let mut kept = vec![false; rows.len()];
    let mut keep = |plan: &Plan| {
        for filter in [Filter::Linear, Filter::Texels] {
            let mut counter = Counter::new(plan, filter);
            let fetches: Vec<u32> = rows.iter().map(|r| counter.fetches(r.choice)).collect();
            let mut order: Vec<usize> = (0..rows.len()).collect();
            order.sort_by(|&a, &b| {
                let by_fetches = fetches[a].cmp(&fetches[b]);
                by_fetches.then(rows[a].rank().total_cmp(&rows[b].rank()))
            });
            let mut best = f64::INFINITY;
            for at in order {
                if rows[at].rank() < best {
                    best = rows[at].rank();
                    kept[at] = true;
                }
            }
        }
    };
    for material in preset::NAMES {
        for light_map in LIGHT_MAPS {
            let mut plan = statue.clone();
            plan.scene.material = Material::preset(material).map_err(Failure::Input)?;
            plan.light_map = light_map;
            keep(&plan);
        }
    }
    for material in MATERIALS {
        for scene in &SCENES {
            keep(&plan(scene, material)?);
        }
    }
    let mut rows: Vec<Row> = rows
        .iter()
        .zip(kept)
        .filter_map(|(row, kept)| kept.then_some(*row))
        .collect();
    rows.sort_by(|a, b| {
        let by_fetches = a.fetches.cmp(&b.fetches);
        by_fetches.then(a.rank().total_cmp(&b.rank()))
    });
    Ok(rows)
}

fn write(output: &Output, head: &str, rows: &[Row]) -> Result<(), report::Error> {
    output.write(|writer| -> Result<(), csv::Error> {
        writer.write_all(head.as_bytes())?;
        let mut table = csv::Writer::from_writer(writer);
        table.write_record(COLUMNS)?;
        for row in rows {
            table.write_record([
                row.choice.multiple_flags(),
                row.choice.single_flags(),
                format!("{:.4}", row.expected),
                format!("{:.4}", row.worst),
                row.fetches.to_string(),
            ])?;
        }
        Ok(table.flush()?)
    })
}

/// Today in UTC, year-month-day (Howard Hinnant, "chrono-compatible low-level date algorithms").
fn date() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH);
    // A clock before 1970 tells no date worth more than that.
    let days = seconds.map_or(0, |since| since.as_secs() / 86_400) + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    // Its years begin in March.
    let (month, later) = if month < 10 {
        (month + 3, 0)
    } else {
        (month - 9, 1)
    };
    format!("{}-{month:02}-{day:02}", era * 400 + year + later)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Image;

    #[test]
    fn errors_of_sums_are_those_that_compare_tells() {
        // Any values will do.
        let picture = |seed: f32, alpha: bool| -> Vec<[f32; 4]> {
            let value = |at: usize, channel: usize| {
                (seed * (1 + at * 3 + channel) as f32).sin().abs() + 0.1
            };
            let pixel = |at| {
                let cover = if alpha && at % 5 == 0 { 0.5 } else { 1.0 };
                [value(at, 0), value(at, 1), value(at, 2), cover]
            };
            (0..48).map(pixel).collect()
        };
        let (exact, traced) = (picture(1.1, true), picture(2.3, false));
        let (multiple, single) = (picture(1.7, false), picture(3.1, false));
        let bare: Vec<_> = traced.iter().map(|p| [p[0], p[1], p[2]]).collect();
        let basis = Basis::new(&exact, &bare);
        let d = basis.difference(&multiple, &exact);
        let e = basis.difference(&single, &traced);
        let sum = dot(&d, &d) + 2.0 * dot(&d, &e) + dot(&e, &e);
        let image = |a: &[[f32; 4]], b: &[[f32; 4]]| Image {
            name: "a picture".to_owned(),
            size: [8, 6],
            pixels: a
                .iter()
                .zip(b)
                .map(|(a, b)| [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3]])
                .collect(),
            has_alpha: true,
            encoded: false,
        };
        let told = compare::compare(&image(&exact, &traced), &image(&multiple, &single));
        let rr = told.expect("comparable").rr;
        let found = (sum / d.len() as f64).sqrt();
        assert!((found - rr).abs() < 1e-6, "{found} {rr}");
    }

    #[test]
    fn scenes_are_solid_and_in_view() {
        for scene in &SCENES {
            let plan = plan(scene, "marble").expect("a plan");
            assert!(plan.scene.mesh.is_solid(), "{:?}", scene.0);
            assert_eq!(plan.size, scene.3);
            let away = plan.scene.camera.eye.distance(plan.scene.mesh.center());
            assert!(away > plan.scene.mesh.bounding_radius());
        }
    }

    #[test]
    fn a_table_is_read_as_it_was_written() {
        let rows: Vec<Row> = multiples()
            .into_iter()
            .zip(singles().into_iter().cycle())
            .zip(1..)
            .map(|((multiple, single), fetches)| Row {
                choice: Choice { multiple, single },
                expected: f64::from(fetches) / 1e4,
                worst: 0.5,
                fetches,
            })
            .collect();
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("plans.csv");
        let output = Output::check(&path).expect("writable");
        write(&output, "# A head.\n", &rows).expect("written");
        let text = std::fs::read_to_string(&path).expect("a file");
        let mut read = crate::ledger::budget::parse(&text).expect("a table");
        read.sort_by_key(|row| row.fetches);
        assert_eq!(read, rows);
        assert!(date().starts_with("20") && date().len() == 10);
    }
}
