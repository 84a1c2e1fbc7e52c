//! `marmor animate`: the frames of an animation.

use super::failure::Failure;
use super::picture::{self, PictureArguments};
use super::progress::Bar;
use super::{Global, print, render, values};
use crate::frame::{Animator, PassTime, Picture};
use crate::report::image::{self, Moving};
use crate::report::{Format, Image, Output};
use crate::scene::sequence::Pattern;
use crate::scene::{Method, Motion, Plan, Single, defaults};
use clap::Args;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Render an animation, frame by frame
///
/// A frame depends on its number alone: any range may be drawn by any process, in any order, and comes out the same to
/// the byte. Each is the mean of jittered frames of one instant (--frames-averaged).
/// With --live each is drawn once and goes on from those before it, as a live display would show it.
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor animate --turntable -o turn.gif --size 400x300
      once around the bundled statue
  marmor animate fish.glb --clip swim --turntable -o out/%04d.png
      a clip of an animated mesh, seen from all sides
  marmor animate scene.toml --frames 0..29 -o out/%04d.exr
      a part of the frames; another process may draw 30..59
  marmor animate --turntable --live -o live/%04d.png
      what a live display would show
  marmor animate walk_%04d.obj --fps 30 -o out/%04d.png --resume
      a sequence of meshes; frames that are there already are kept")]
pub(super) struct Arguments {
    #[command(flatten)]
    picture: PictureArguments,

    /// Files to write: a sequence such as out/%04d.png or out/%04d.exr, whose folder is made, or one .gif or .apng
    #[arg(short, long, value_name = "FILES", help_heading = "Output")]
    output: PathBuf,

    /// First and last frame, from 0 on; beyond the last the animation begins anew [default: all]
    #[arg(long, value_name = "A..B", value_parser = values::range, allow_hyphen_values = true, help_heading = "Output")]
    frames: Option<RangeInclusive<u32>>,

    /// Keep the frames that are there, whole and of the right size, and draw the others
    #[arg(long, help_heading = "Output")]
    resume: bool,

    /// Draw each frame once, joined with a history of those before it, as a live display would
    ///
    /// The history follows what moves. A frame then depends on those before it: before the first it draws the 16 frames that
    /// lead up to it, and --resume and --frames-averaged do not go with it.
    #[arg(long, help_heading = "Animation")]
    live: bool,

    /// Turn the camera once about the vertical
    #[arg(long, help_heading = "Animation")]
    turntable: bool,

    /// Turns of the light about the vertical over the animation [default: 0]
    #[arg(long, value_name = "N", value_parser = values::finite, allow_hyphen_values = true, help_heading = "Animation")]
    light_turns: Option<f64>,

    /// Frames a second, from 0.01 to 1000 [default: 25]
    #[arg(long, value_name = "N", value_parser = values::fps, allow_hyphen_values = true, help_heading = "Animation")]
    fps: Option<f64>,

    /// Seconds [default: that of the clip, the sequence, the longest beat or the last keyframe, or 4]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration, allow_hyphen_values = true, help_heading = "Animation")]
    duration: Option<f64>,
}

/// Frames a second that viewers play of a GIF: below two hundredths of a second they take ten.
const GIF_FPS: f64 = 50.0;

/// Where frames go.
enum Target {
    /// Each to a file of its own.
    Files(Pattern, Format),
    /// All to one.
    File(Output, Moving),
}

pub(super) fn run(global: &Global, arguments: &Arguments) -> Result<(), Failure> {
    if arguments.live {
        check_live(arguments)?;
    }
    let target = target(arguments)?;
    let (plan, motion) = plan(global, arguments)?;
    if matches!(target, Target::File(_, Moving::Gif)) && motion.fps() > GIF_FPS {
        return Err(Failure::Input(format!(
            "{}: a GIF plays at most {GIF_FPS} frames a second, not {:.2}; lower --fps, or name an .apng",
            arguments.output.display(),
            motion.fps()
        )));
    }
    let range = arguments
        .frames
        .clone()
        .unwrap_or(0..=motion.frames.saturating_sub(1));
    let all = range.end() - range.start();
    let (most, what) = match &target {
        Target::Files(..) => (defaults::FRAMES_DRAWN_MAX, "frames"),
        // They are held until the last is drawn.
        Target::File(..) => (defaults::FRAMES_MAX, "frames in one file"),
    };
    if all >= most {
        return Err(Failure::Input(format!(
            "--frames {}..{}: more than {most} {what}; draw them in parts",
            range.start(),
            range.end()
        )));
    }
    let wanted: Vec<u32> = match &target {
        Target::Files(pattern, _) => {
            folder(&pattern.path(*range.start()))?;
            if let Some(path) = range.clone().map(|n| pattern.path(n)).find(|p| p.is_dir()) {
                return Err(Failure::Input(format!(
                    "{}: is a folder; name other files to write",
                    path.display()
                )));
            }
            let whole = |number: &u32| is_whole(&pattern.path(*number), plan.size);
            let missing = range.clone().filter(|n| !(arguments.resume && whole(n)));
            missing.collect()
        }
        Target::File(..) => range.clone().collect(),
    };

    let mut bar = Bar::new(global.quiet);
    let mut times = Times::default();
    let mut still = Vec::new();
    if !wanted.is_empty() {
        let mut animator = Animator::new(&global.options(), &plan, &motion, arguments.live)?;
        for (done, &number) in (1..).zip(&wanted) {
            tracing::info!("frame {number}: {} s", motion.time(number));
            let mut picture = animator.draw(number, &mut |_| ())?;
            if plan.single == Single::Traced {
                let instant = plan.at(motion.time(number));
                render::add_traced(&instant, &mut picture, &mut bar);
            }
            for message in &picture.validation_messages {
                tracing::warn!("validation: {message}");
            }
            times.add(&picture);
            match &target {
                Target::Files(pattern, format) => write(&pattern.path(number), *format, &picture)?,
                Target::File(..) => still.push(picture.display),
            }
            bar.report_frames(done, wanted.len() as u64);
        }
    }
    bar.clear();
    if let Target::File(output, moving) = &target {
        image::write_moving(output, *moving, plan.size, &still, motion.fps())?;
    }
    if global.quiet {
        return Ok(());
    }
    print(&format!(
        "{}: frames {}..{} of a loop of {}, {}x{}, {:.2} s at {:.2} frames a second{}\n{}",
        arguments.output.display(),
        range.start(),
        range.end(),
        motion.frames,
        plan.size[0],
        plan.size[1],
        motion.duration,
        motion.fps(),
        match all as usize + 1 - wanted.len() {
            0 => String::new(),
            kept => format!("; {kept} were there"),
        },
        times.summary(plan.frames_averaged),
    ))
}

/// What --live does not go with.
fn check_live(arguments: &Arguments) -> Result<(), Failure> {
    let refuse = |flag, why| {
        let message = format!("{flag}: with --live {why}; drop {flag}, or --live");
        Err(Failure::Input(message))
    };
    if arguments.resume {
        return refuse("--resume", "a frame depends on those before it");
    }
    if arguments.picture.frames_averaged.is_some() {
        return refuse("--frames-averaged", "each frame is drawn once");
    }
    Ok(())
}

/// Where the frames go, checked as far as it can be before there is anything to write.
fn target(arguments: &Arguments) -> Result<Target, Failure> {
    let path = &arguments.output;
    let place = |phrase: String| Failure::Input(format!("{}: {phrase}", path.display()));
    if let Some(pattern) = Pattern::of(path).map_err(place)? {
        return Ok(Target::Files(pattern, Format::of(path)?));
    }
    let Some(moving) = Moving::of(path) else {
        return Err(place(
            "is no animation; name one .gif or .apng file, or a sequence with the number as %04d, such as out/%04d.png"
                .to_owned(),
        ));
    };
    if arguments.resume {
        return Err(Failure::Input(
            "--resume goes with a sequence of files; drop it, or name out/%04d.png".to_owned(),
        ));
    }
    Ok(Target::File(Output::check(path)?, moving))
}

/// The plan, and what moves in it.
fn plan(global: &Global, arguments: &Arguments) -> Result<(Plan, Arc<Motion>), Failure> {
    if arguments.picture.time.is_some() {
        return Err(Failure::Input(
            "--time is for one picture; drop it, or choose frames with --frames".to_owned(),
        ));
    }
    let mut request = arguments.picture.request()?;
    request.time = None;
    if arguments.live {
        // History takes the place of what a scene file averages.
        request.frames_averaged = Some(1);
    }
    let noisy = request.multiple == Method::Samples && request.fetch_budget.is_none();
    request.frames_averaged.get_or_insert(match noisy {
        true => defaults::FRAMES_AVERAGED_NOISY,
        false => defaults::FRAMES_AVERAGED_MOVING,
    });
    let animation = &mut request.animation;
    if arguments.turntable {
        animation.camera_turns = 1.0;
    }
    if let Some(turns) = arguments.light_turns {
        animation.light_turns = turns;
    }
    if let Some(fps) = arguments.fps {
        animation.fps = fps;
    }
    if arguments.duration.is_some() {
        animation.duration = arguments.duration;
    }
    let (plan, _) = picture::plan(&request, &global.options())?;
    if arguments.live && plan.single == Single::Traced {
        return Err(Failure::Input(
            "--single traced goes with no history; drop --live, or choose a number of steps"
                .to_owned(),
        ));
    }
    let motion = plan.motion.clone().ok_or_else(|| {
        Failure::Input(format!(
            "{}: nothing moves; add --turntable or --light-turns 1, name an animated mesh, or write [animation] in the \
             scene file (docs/scene.md)",
            request.name
        ))
    })?;
    Ok((plan, motion))
}

/// Makes the folder of `path`, if it is not there, and checks that it can be written to.
fn folder(path: &Path) -> Result<(), Failure> {
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        std::fs::create_dir_all(folder).map_err(|error| {
            Failure::Input(format!(
                "{}: the folder cannot be made ({error}); choose another",
                folder.display()
            ))
        })?;
    }
    Output::check(path)?;
    Ok(())
}

/// Whether `path` holds a picture of `size` that decodes to its last pixel.
fn is_whole(path: &Path, size: [u32; 2]) -> bool {
    path.is_file() && Image::read(path).is_ok_and(|image| image.size == size)
}

fn write(path: &Path, format: Format, picture: &Picture) -> Result<(), Failure> {
    let output = Output::check(path)?;
    match format {
        Format::Png => image::write_png(&output, picture.size, &picture.display)?,
        Format::Exr => image::write_exr(&output, picture.size, &picture.radiance)?,
    }
    Ok(())
}

/// Times of passes, summed over pictures.
#[derive(Default)]
struct Times {
    pictures: u32,
    wall: f64,
    passes: Vec<PassTime>,
    device: String,
}

impl Times {
    fn add(&mut self, picture: &Picture) {
        self.pictures += 1;
        self.wall += picture.wall_milliseconds;
        self.device.clone_from(&picture.device);
        for time in &picture.passes {
            let sum = time.milliseconds * f64::from(time.frames);
            match self.passes.iter_mut().find(|known| known.pass == time.pass) {
                Some(known) => {
                    known.milliseconds += sum;
                    known.frames += time.frames;
                }
                None => self.passes.push(PassTime {
                    milliseconds: sum,
                    ..time.clone()
                }),
            }
        }
    }

    /// What a frame cost, in words; nothing where none was drawn.
    fn summary(&self, averaged: u32) -> String {
        if self.pictures == 0 {
            return String::new();
        }
        let passes: Vec<String> = self
            .passes
            .iter()
            .map(|time| {
                let mean = time.milliseconds / f64::from(time.frames.max(1));
                format!("{} {mean:.2}", time.pass)
            })
            .collect();
        let each = match averaged {
            1 => "a frame".to_owned(),
            _ => format!("for each of {averaged} averaged"),
        };
        format!(
            "{}: {:.2} ms {each} ({})\n",
            self.device,
            self.wall / f64::from(self.pictures),
            passes.join(", "),
        )
    }
}
