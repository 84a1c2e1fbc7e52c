//! What a run shows, in sentences.

use super::table::VALIDATION;
use super::{Case, Pass, Run, Spread, digits, distinct, error, fits_in_words};

impl Run {
    /// Reasons not to take the figures at face value.
    pub(super) fn warnings(&self) -> Vec<String> {
        let validation = self.header.validation.then(|| VALIDATION.to_owned());
        let incomplete = (!self.complete).then(|| self.incomplete());
        validation.into_iter().chain(incomplete).collect()
    }

    /// What the run shows, one finding a sentence.
    pub(super) fn findings(&self) -> Vec<String> {
        let mut findings = Vec::new();
        for (group, cases) in self.groups() {
            for scene in distinct(cases.iter().map(|case| case.scene.as_str())) {
                let own: Vec<&Case> = cases
                    .iter()
                    .copied()
                    .filter(|case| case.scene == scene)
                    .collect();
                findings.extend(front(group, scene, &own));
            }
        }
        findings.extend(self.shares());
        findings.extend(self.floors());
        for (group, _) in self.groups() {
            let fits = self.fits.iter().filter(|fit| fit.group == group);
            let words = fits_in_words(fits).into_iter();
            findings.extend(words.map(|words| format!("{group}: {words}")));
        }
        findings
    }

    /// Where the time goes.
    fn shares(&self) -> Option<String> {
        let total: f64 = self
            .cases
            .iter()
            .flat_map(|case| &case.passes)
            .map(median)
            .sum();
        if total <= 0.0 || !total.is_finite() {
            return None;
        }
        let mut shares: Vec<(f64, &str)> = self
            .passes()
            .into_iter()
            .map(|name| (self.of(name).map(median).sum::<f64>() / total, name))
            .collect();
        shares.sort_by(|a, b| b.0.total_cmp(&a.0));
        let told: Vec<_> = shares
            .iter()
            .take(3)
            .map(|(share, name)| format!("{name} {:.0} %", 100.0 * share))
            .collect();
        Some(format!("Of all device time measured: {}.", told.join(", ")))
    }

    /// How far the pass that fetches longest is from its floor.
    fn floors(&self) -> Option<String> {
        let floor = |name: &str| self.of(name).filter_map(|pass| pass.floor).sum::<f64>();
        let name = self
            .passes()
            .into_iter()
            .max_by(|a, b| floor(a).total_cmp(&floor(b)))?;
        let factors: Vec<f64> = self.of(name).filter_map(Pass::over_floor).collect();
        if factors.is_empty() {
            return None;
        }
        let Spread {
            median, p5, p95, ..
        } = Spread::of(factors);
        Some(format!(
            "The pass {name} takes {} times as long as its fetches alone would \
             ({} to {} in nine of ten cases).",
            digits(median),
            digits(p5),
            digits(p95)
        ))
    }

    fn of(&self, name: &str) -> impl Iterator<Item = &Pass> {
        let passes = self.cases.iter().flat_map(|case| &case.passes);
        passes.filter(move |pass| pass.pass == name)
    }
}

fn median(pass: &Pass) -> f64 {
    pass.time.median
}

/// The cases that no other beats in both error and time, where there are errors to compare.
fn front(group: &str, scene: &str, cases: &[&Case]) -> Option<String> {
    let mut rated: Vec<(f64, f64, &Case)> = cases
        .iter()
        .filter(|case| !case.light_rests)
        .filter_map(|case| Some((case.device.median, case.error?, *case)))
        .filter(|(_, error, _)| error.is_finite())
        .collect();
    if rated.len() < 2 {
        return None;
    }
    rated.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    let mut told = Vec::new();
    for (time, rr, case) in rated {
        if rr < least {
            least = rr;
            told.push(format!(
                "{} ({} ms, rr {})",
                case.label(),
                digits(time),
                error(rr)
            ));
        }
    }
    Some(format!(
        "{group}, {scene}: no other case beats these in both time and error: {}.",
        told.join("; ")
    ))
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;

    fn case(name: &str, time: f64, error: Option<f64>) -> Case {
        let mut case = example::run().cases[0].clone();
        case.multiple = name.to_owned();
        case.device.median = time;
        case.error = error;
        case
    }

    #[test]
    fn the_front_has_what_nothing_beats() {
        let cases = [
            case("slow", 9.0, Some(0.01)),
            case("beaten", 5.0, Some(0.2)),
            case("middle", 4.0, Some(0.1)),
            case("fast", 1.0, Some(0.5)),
            case("unrated", 0.5, None),
        ];
        let cases: Vec<&Case> = cases.iter().collect();
        let told = front("methods", "statue", &cases).expect("a front");
        assert!(
            told.ends_with("error: fast (1.00 ms, rr 0.500); middle (4.00 ms, rr 0.100); slow (9.00 ms, rr 0.0100)."),
            "{told}"
        );
        assert_eq!(front("methods", "statue", &cases[4..]), None);
    }

    #[test]
    fn shares_and_floors_are_those_of_the_passes() {
        let mut run = example::run();
        run.cases.truncate(1);
        let passes = &mut run.cases[0].passes;
        passes.truncate(2);
        passes[0].time.median = 1.0;
        passes[1].time.median = 3.0;
        passes[1].floor = Some(1.5);
        let [first, second] = [passes[0].pass.clone(), passes[1].pass.clone()];
        assert_eq!(
            run.shares(),
            Some(format!(
                "Of all device time measured: {second} 75 %, {first} 25 %."
            ))
        );
        let told = run.floors().expect("a floor");
        assert!(
            told.starts_with(&format!("The pass {second} takes 2.00 times")),
            "{told}"
        );
        run.cases.clear();
        assert_eq!((run.shares(), run.floors()), (None, None));
    }
}
