//! The flags that say what a picture is of and how it is drawn, shared by every command that draws one.

use super::failure::Failure;
use super::values::{self, Background, Direction, Orbit};
use crate::frame;
use crate::ledger::Filter;
use crate::ledger::budget::{self, Chosen};
use crate::optics::mixture::Fit;
use crate::scene::{
    Exits, Jitter, Material, Method, Mixture, Plan, Request, Scattering, Single, Viewpoint,
};
use clap::Args;
use glam::DVec3;
use std::path::PathBuf;

/// What is drawn, and how. Flags override the scene file.
#[derive(Args, Debug)]
pub(super) struct PictureArguments {
    /// A scene file (.toml), a mesh (.obj, .gltf, .glb, or a sequence walk_%04d.obj), or a bundled mesh: statue,
    /// statue-1k, statue-5k, statue-20k, betta
    #[arg(value_name = "SCENE", default_value = "statue")]
    scene: PathBuf,

    /// Width and height, pixels, each from 1 to 16384 [default: 800x600]
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, help_heading = "Picture")]
    size: Option<[u32; 2]>,

    /// Factor on radiance before it is encoded for display (PNG only) [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = values::positive, allow_hyphen_values = true, help_heading = "Picture")]
    exposure: Option<f64>,

    /// Colour behind the object (PNG only); none keeps it transparent [default: none]
    #[arg(long, value_name = "#rrggbb|none", value_parser = values::background, help_heading = "Picture")]
    background: Option<Background>,

    /// How many frames to average; edges and noise converge [default: 1; of an animation 8, by the method samples 32]
    #[arg(long, value_name = "N", value_parser = values::frames_averaged, allow_hyphen_values = true, help_heading = "Picture")]
    pub(super) frames_averaged: Option<u32>,

    /// What moves between averaged frames [default: all]
    ///
    /// all: camera by a sub-pixel, light map by a sub-texel, sample sequence;
    /// samples: the sequence only, so that pictures compare pixel by pixel; off: nothing.
    #[arg(long, value_name = "all|samples|off", value_parser = values::jitter, help_heading = "Picture")]
    jitter: Option<Jitter>,

    /// A measured material [default: marble]
    ///
    /// apple, chicken1, chicken2, cream, ketchup, marble, potato, skimmilk, skin1, skin2,
    /// spectralon, wholemilk (Jensen et al. 2001).
    #[arg(long, value_name = "NAME", value_parser = Material::preset, help_heading = "Material")]
    material: Option<Material>,

    /// Reduced scattering coefficient per channel, mm^-1
    #[arg(long, value_name = "R,G,B", value_parser = values::sigma_s, allow_hyphen_values = true, help_heading = "Material")]
    sigma_s: Option<DVec3>,

    /// Absorption coefficient per channel, mm^-1
    #[arg(long, value_name = "R,G,B", value_parser = values::sigma_a, allow_hyphen_values = true, help_heading = "Material")]
    sigma_a: Option<DVec3>,

    /// Relative index of refraction, from 1 to 3
    #[arg(long, value_name = "ETA", value_parser = values::eta, allow_hyphen_values = true, help_heading = "Material")]
    eta: Option<f64>,

    /// Mean cosine of the phase function of light scattered once, from -0.95 to 0.95 [default: 0]
    ///
    /// The coefficients stay reduced: single scattering takes sigma_s = sigma_s' / (1 - g).
    #[arg(long, value_name = "G", value_parser = values::g, allow_hyphen_values = true, help_heading = "Material")]
    g: Option<f64>,

    /// Size of the object: mm per mesh unit [default: 1]
    #[arg(long, value_name = "MM", value_parser = values::positive, allow_hyphen_values = true, help_heading = "Material")]
    unit: Option<f64>,

    /// Where the light stands, degrees: azimuth from the viewer's side (+Z) to the right,
    /// elevation above the horizon
    #[arg(long, value_name = "AZ,EL", value_parser = values::light, allow_hyphen_values = true, help_heading = "Light and camera")]
    light: Option<Direction>,

    /// Where the camera stands, degrees as for the light, and its distance, mm
    ///
    /// Without a distance the object is fitted into the picture.
    #[arg(long, value_name = "AZ,EL[,DIST]", value_parser = values::camera, allow_hyphen_values = true, help_heading = "Light and camera")]
    camera: Option<Orbit>,

    /// The instant of a picture of something that moves, s [default: 0]
    #[arg(long, value_name = "SECONDS", value_parser = values::time, allow_hyphen_values = true, help_heading = "Animation")]
    pub(super) time: Option<f64>,

    /// The clip of an animated mesh [default: its first]
    #[arg(long, value_name = "NAME", help_heading = "Animation")]
    clip: Option<String>,

    /// Choose how light is scattered by the fetches that a pixel may make, from 1 to 1000000
    ///
    /// Of the plans whose error was measured the best is taken that makes no more, all passes over the picture counted;
    /// it says which. In place of --multiple, --single and their parameters; --specular and --frames-averaged stay
    /// yours, and cost one fetch each. What passes over the light map read is not a pixel's, and not counted.
    #[arg(long, value_name = "N", value_parser = values::budget, allow_hyphen_values = true, help_heading = "Method")]
    fetch_budget: Option<u32>,

    /// Multiple scattering [default: samples]
    ///
    /// none; brdf: no transport, the opaque baseline; samples: importance-sampled Monte
    /// Carlo; rings: square rings of a MIP pyramid, as published in 2007; mixture: Gaussians
    /// from a pyramid of depth moments, smooth in a handful of fetches; exact: the sum over
    /// every texel of the light map, the slow reference.
    #[arg(long, value_name = "none|brdf|samples|rings|mixture|exact", value_parser = values::method, help_heading = "Method")]
    multiple: Option<Method>,

    /// Samples a pixel, from 1 to 256, for the method samples [default: 30]
    #[arg(long, value_name = "N", value_parser = values::samples, allow_hyphen_values = true, help_heading = "Method")]
    samples: Option<u32>,

    /// Rings, from 1 to 14, for the method rings [default: 8]
    #[arg(long, value_name = "N", value_parser = values::rings, allow_hyphen_values = true, help_heading = "Method")]
    rings: Option<u32>,

    /// Moments of depth that the mixture reads, 3 or 4; the fourth is a second texture [default: 3]
    #[arg(long, value_name = "3|4", value_parser = values::moments, allow_hyphen_values = true, help_heading = "Method")]
    moments: Option<u32>,

    /// First level of the mixture that reads the fourth moment, 0 to 13, with --moments 4 [default: 0]
    #[arg(long, value_name = "LEVEL", value_parser = values::level, allow_hyphen_values = true, help_heading = "Method")]
    fourth_from: Option<u32>,

    /// How many levels of the mixture read the fourth moment, 1 to 9: those that carry the most light,
    /// with --moments 4 [default: all]
    #[arg(long, value_name = "N", value_parser = values::fourth_levels, allow_hyphen_values = true, conflicts_with = "fourth_from", help_heading = "Method")]
    fourth_levels: Option<u32>,

    /// 1: the mixture taps every level; 2: every second, at half the fetches [default: 1]
    #[arg(long, value_name = "1|2", value_parser = values::level_step, allow_hyphen_values = true, help_heading = "Method")]
    level_step: Option<u32>,

    /// How many levels of the mixture, the coarsest, read volumes of light, 0 to 8 [default: 0]
    ///
    /// Where a kernel holds many surfaces moments are too few; a volume needs none. Each more takes up to eight
    /// times the cells, and the finest two are read beside moments. Those too large stay with moments.
    #[arg(long, value_name = "N", value_parser = values::volumes, allow_hyphen_values = true, help_heading = "Method")]
    volumes: Option<u32>,

    /// Where the weights of the mixture come from [default: best]
    ///
    /// closed: the closed form; fitted: non-negative least squares on R_d and its energy;
    /// best: whichever is nearer to R_d, channel by channel.
    #[arg(long, value_name = "closed|fitted|best", value_parser = Mixture::weights, help_heading = "Method")]
    weights: Option<Fit>,

    /// Draw the left part of the picture by another method
    #[arg(long, value_name = "METHOD", value_parser = values::method, help_heading = "Method")]
    split: Option<Method>,

    /// How much of the picture's width --split draws, from 0 to 1 [default: 0.5]
    #[arg(long, value_name = "SHARE", value_parser = values::share, allow_hyphen_values = true, help_heading = "Method")]
    split_at: Option<f64>,

    /// Single scattering: samples along the refracted view ray, from 1 to 64; or off; or traced [default: 8]
    ///
    /// Each sample is one fetch; fewer than four are for looking at the method. traced: rays cast on the mesh, 1024
    /// steps a pixel, on the CPU: the slow reference, some seconds for a hundred pixels squared. Goes with every method but brdf, which knows no transport.
    #[arg(long, value_name = "K|off|traced", value_parser = values::single, allow_hyphen_values = true, help_heading = "Method")]
    single: Option<Single>,

    /// How the samples of single scattering find the lit surface [default: linear]
    ///
    /// linear: a bilinear tap of the light map, whose moments tell two surfaces from one; nearest: its
    /// nearest texel; depth: the nearest texel of the depth buffer, without the surface's angle.
    #[arg(long, value_name = "linear|nearest|depth", value_parser = values::exits, help_heading = "Method")]
    exits: Option<Exits>,

    /// Size at which multiple and single scattering are shaded [default: full]
    ///
    /// half: once for four pixels, in less than half the time; edges of shadows are a pixel softer. Not for brdf,
    /// exact, --split or --single traced.
    #[arg(long, value_name = "full|half", value_parser = Scattering::named, help_heading = "Method")]
    scattering: Option<Scattering>,

    /// Reflection at the surface [default: on]
    #[arg(long, value_name = "on|off", value_parser = values::on_off, action = clap::ArgAction::Set, help_heading = "Method")]
    specular: Option<bool>,

    /// Texels along a side of the light map, from 16 to 8192 [default: 512]
    #[arg(long, value_name = "N", value_parser = values::light_map, allow_hyphen_values = true, help_heading = "Method")]
    light_map: Option<u32>,
}

impl PictureArguments {
    /// Defaults, then the scene file, then the flags; checked, and nothing loaded yet.
    pub(super) fn request(&self) -> Result<Request, Failure> {
        let arguments = self;
        let mut request = Request::open(&arguments.scene)?;
        self.settle_budget(&mut request)?;
        fn set<T: Clone>(field: &mut T, flag: &Option<T>) {
            if let Some(value) = flag {
                field.clone_from(value);
            }
        }
        set(&mut request.size, &arguments.size);
        set(&mut request.exposure, &arguments.exposure);
        set(
            &mut request.frames_averaged,
            &arguments.frames_averaged.map(Some),
        );
        set(&mut request.jitter, &arguments.jitter);
        set(&mut request.unit, &arguments.unit);
        set(&mut request.fetch_budget, &arguments.fetch_budget.map(Some));
        set(&mut request.multiple, &arguments.multiple);
        set(&mut request.samples, &arguments.samples);
        set(&mut request.rings, &arguments.rings);
        set(&mut request.moments, &arguments.moments);
        set(&mut request.fourth_from, &arguments.fourth_from);
        set(
            &mut request.fourth_levels,
            &arguments.fourth_levels.map(Some),
        );
        set(&mut request.level_step, &arguments.level_step);
        set(&mut request.volumes, &arguments.volumes);
        set(&mut request.weights, &arguments.weights);
        set(&mut request.single, &arguments.single);
        set(&mut request.exits, &arguments.exits);
        set(&mut request.scattering, &arguments.scattering);
        set(&mut request.specular, &arguments.specular);
        set(&mut request.light_map, &arguments.light_map);
        set(&mut request.split, &arguments.split.map(Some));
        set(&mut request.split_at, &arguments.split_at);
        set(
            &mut request.background,
            &arguments.background.map(|background| background.0),
        );

        set(&mut request.time, &arguments.time.map(Some));
        set(
            &mut request.animation.clip,
            &arguments.clip.clone().map(Some),
        );
        let chosen = [
            arguments.material.is_some(),
            arguments.sigma_s.is_some(),
            arguments.sigma_a.is_some(),
        ];
        request.colored_by_mesh &= !chosen.contains(&true);
        set(&mut request.material, &arguments.material);
        let material = &mut request.material;
        set(&mut material.sigma_s, &arguments.sigma_s);
        set(&mut material.sigma_a, &arguments.sigma_a);
        set(&mut material.eta, &arguments.eta);
        set(&mut material.g, &arguments.g);
        let custom = [arguments.sigma_s.is_some(), arguments.sigma_a.is_some()];
        if custom.contains(&true) || arguments.eta.is_some() || arguments.g.is_some() {
            material.name = "custom".to_owned();
        }

        if let Some(light) = arguments.light {
            request.light.azimuth = light.azimuth;
            request.light.elevation = light.elevation;
            if request.animation.light_keys.take().is_some() {
                tracing::info!("--light takes the place of the light's keyframes");
            }
        }
        if let Some(orbit) = arguments.camera {
            // The flag says from where; what the file looks at stays in the middle.
            let target = match request.viewpoint {
                Viewpoint::Orbit { target, .. } => target,
                Viewpoint::At { target, .. } => Some(target),
            };
            if request.animation.camera_keys.take().is_some() {
                tracing::info!("--camera takes the place of the camera's keyframes");
            }
            request.viewpoint = Viewpoint::Orbit {
                azimuth: orbit.direction.azimuth,
                elevation: orbit.direction.elevation,
                distance: orbit.distance,
                target,
            };
        }

        // A flag that would do nothing is a mistake that a picture would not show.
        let idle = [
            ("--samples", arguments.samples.is_some(), Method::Samples),
            ("--rings", arguments.rings.is_some(), Method::Rings),
            ("--moments", arguments.moments.is_some(), Method::Mixture),
            (
                "--fourth-from",
                arguments.fourth_from.is_some(),
                Method::Mixture,
            ),
            (
                "--fourth-levels",
                arguments.fourth_levels.is_some(),
                Method::Mixture,
            ),
            (
                "--level-step",
                arguments.level_step.is_some(),
                Method::Mixture,
            ),
            ("--volumes", arguments.volumes.is_some(), Method::Mixture),
            ("--weights", arguments.weights.is_some(), Method::Mixture),
        ]
        .into_iter()
        .find(|&(_, given, of)| given && request.multiple != of && request.split != Some(of));
        if let Some((flag, _, of)) = idle {
            return Err(Failure::Input(format!(
                "{flag} has no effect on the method {}; drop it, or add --multiple {}",
                request.multiple.name(),
                of.name(),
            )));
        }
        let fourth = [
            ("--fourth-from", arguments.fourth_from.is_some()),
            ("--fourth-levels", arguments.fourth_levels.is_some()),
        ];
        if let Some((flag, _)) = fourth.iter().find(|f| f.1 && request.moments != 4) {
            return Err(Failure::Input(format!(
                "{flag} has no effect on 3 moments; drop it, or add --moments 4"
            )));
        }
        if arguments.split_at.is_some() && request.split.is_none() {
            return Err(Failure::Input(
                "--split-at has no effect on a picture that is not split; drop it, or add --split brdf"
                    .to_owned(),
            ));
        }
        if arguments.exits.is_some() && !matches!(request.single, Single::March(_)) {
            return Err(Failure::Input(format!(
                "--exits has no effect on --single {}; drop it, or add --single 8",
                request.single
            )));
        }
        let chosen = request.fetch_budget.is_some();
        if arguments.g.is_some() && request.single == Single::Off && !chosen {
            return Err(Failure::Input(
                "--g has no effect without single scattering; drop it, or add --single 8"
                    .to_owned(),
            ));
        }
        let transport =
            request.multiple != Method::Brdf || request.split.is_some_and(|m| m != Method::Brdf);
        if matches!(arguments.single, Some(single) if single != Single::Off) && !transport {
            return Err(Failure::Input(
            "--single has no effect on the method brdf, which knows no transport; drop it, or add \
             --multiple none for single scattering alone"
                .to_owned(),
        ));
        }
        Ok(request)
    }

    /// Says who chooses the methods, a budget or the flags: never both. A flag takes the place of what a scene file says.
    fn settle_budget(&self, request: &mut Request) -> Result<(), Failure> {
        let chosen = [
            ("--multiple", self.multiple.is_some()),
            ("--samples", self.samples.is_some()),
            ("--rings", self.rings.is_some()),
            ("--moments", self.moments.is_some()),
            ("--fourth-from", self.fourth_from.is_some()),
            ("--fourth-levels", self.fourth_levels.is_some()),
            ("--level-step", self.level_step.is_some()),
            ("--volumes", self.volumes.is_some()),
            ("--weights", self.weights.is_some()),
            ("--single", self.single.is_some()),
            ("--exits", self.exits.is_some()),
            ("--split", self.split.is_some()),
            ("--split-at", self.split_at.is_some()),
        ];
        let Some((flag, _)) = chosen.into_iter().find(|(_, given)| *given) else {
            return Ok(());
        };
        if self.fetch_budget.is_some() {
            return Err(Failure::Input(format!(
                "{flag} cannot stand beside --fetch-budget, which chooses the methods of scattering; drop one of the two"
            )));
        }
        if request.fetch_budget.is_some() && self.multiple.is_none() {
            return Err(Failure::Input(format!(
                "{flag} has no effect beside the fetch_budget of {}, which chooses the methods of scattering; drop it, \
                 or choose them yourself with --multiple",
                self.scene.display()
            )));
        }
        request.fetch_budget = None;
        Ok(())
    }

    /// The plan of the request, and where a budget chose its methods, how. For a budget it asks the device that
    /// `options` name how it filters; whether a plan fits at all it knows without.
    pub(super) fn plan(&self, options: &frame::Options) -> Result<(Plan, Option<Chosen>), Failure> {
        plan(&self.request()?, options)
    }
}

/// The plan of `request`, as [`PictureArguments::plan`].
pub(super) fn plan(
    request: &Request,
    options: &frame::Options,
) -> Result<(Plan, Option<Chosen>), Failure> {
    let plan = request.plan()?;
    let Some(budget) = request.fetch_budget else {
        return Ok((plan, None));
    };
    let rows = budget::table()?;
    let mut chosen = budget::choose(&rows, &plan, budget, Filter::Linear)?;
    let filter = frame::filter(options)?;
    if filter != Filter::Linear {
        // Taps cost more there, so that a cheaper plan may be the best.
        chosen = budget::choose(&rows, &plan, budget, filter)?;
    }
    let (plan, chosen) = chosen;
    Ok((plan, Some(chosen)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::preset;
    use clap::CommandFactory;

    #[derive(clap::Parser)]
    struct Alone {
        #[command(flatten)]
        arguments: PictureArguments,
    }

    fn plan_of(line: &str) -> Plan {
        let words = std::iter::once("marmor").chain(line.split_whitespace());
        let alone = <Alone as clap::Parser>::try_parse_from(words).expect("good flags");
        let request = alone.arguments.request().expect("good flags");
        request.plan().expect("a plan")
    }

    #[test]
    fn flags_override_defaults() {
        let plan = plan_of(
            "statue-1k --size 64x32 --material skin1 --sigma-a 1,2,3 --specular off \
             --multiple exact --split samples --samples 8 --light -20,-30 --camera 0,90,50 \
             --background #000000 --unit 2 --light-map 64 --frames-averaged 4 --jitter samples \
             --single off --exposure 2",
        );
        assert_eq!(plan.size, [64, 32]);
        assert_eq!(plan.scene.material.name, "custom");
        assert_eq!(plan.scene.material.sigma_s, DVec3::new(0.74, 0.88, 1.01));
        assert_eq!(plan.scene.material.sigma_a, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(plan.multiple.to_string(), "exact");
        assert_eq!(
            plan.split.map(|m| m.to_string()),
            Some("samples(8)".to_owned())
        );
        assert_eq!(plan.scene.light.azimuth, -20.0);
        assert_eq!(plan.background, Some([0.0; 3]));
        assert!(!plan.specular);
        let distance = plan.scene.camera.eye.distance(plan.scene.camera.target);
        assert!((distance - 50.0).abs() < 1e-9);
    }

    #[test]
    fn the_help_lists_every_preset() {
        let help = Alone::command().render_long_help().to_string();
        for name in preset::NAMES {
            assert!(help.contains(name), "{name}");
        }
    }
}
