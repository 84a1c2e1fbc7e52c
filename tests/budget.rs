//! The promise: a fetch budget is kept, and buys the least error that was measured for it.

mod common;

use common::program::{file, folder, names, run};
use marmor::ledger::budget::{Counter, Error, Row, choose, table};
use marmor::ledger::{self, Filter, declared};
use marmor::scene::{Bundled, Material, MeshSource, Method, Multiple, Plan, Request};

fn rows() -> Vec<Row> {
    table().expect("the table")
}

/// Scenes whose mixtures have different numbers of levels.
fn plans() -> Vec<Plan> {
    let mut plans = Vec::new();
    for (material, light_map, unit) in [
        ("marble", 512, 1.0),
        ("skin1", 512, 1.0),
        ("wholemilk", 1024, 1.0),
        ("ketchup", 256, 1.0),
        ("spectralon", 512, 1.0),
        ("marble", 64, 1.0),
        ("skimmilk", 512, 0.1),
    ] {
        let request = Request {
            material: Material::preset(material).expect("a preset"),
            light_map,
            unit,
            specular: light_map != 1024,
            frames_averaged: Some(1 + u32::from(light_map == 256)),
            split: Some(Method::Brdf),
            mesh: MeshSource::Bundled(Bundled::Statue5k),
            ..Request::statue()
        };
        plans.push(request.plan().expect("a plan"));
    }
    plans
}

#[test]
fn a_budget_buys_the_least_error_that_fits() {
    let rows = rows();
    for plan in plans() {
        for filter in [Filter::Linear, Filter::Texels] {
            let name = format!("{} {} {filter:?}", plan.scene.material.name, plan.light_map);
            let mut counter = Counter::new(&plan, filter);
            let mut last = f64::INFINITY;
            for budget in (3..=34).chain([40, 48, 64, 200, 1_000_000]) {
                let (chosen, why) = choose(&rows, &plan, budget, filter).expect("a plan");
                let total = ledger::total(&declared(&chosen, filter));
                assert_eq!(total, why.fetches, "{name}, {budget}");
                assert!(total <= budget, "{name}: {total} of {budget}");
                assert_eq!(why.budget, budget);
                for row in &rows {
                    let better = row.rank() < why.row.rank();
                    assert!(
                        !better || counter.fetches(row.choice) > budget,
                        "{name}, {budget}: {} fits, too",
                        row.choice
                    );
                }
                assert!(why.row.rank() <= last, "{name}, {budget}: more bought less");
                last = why.row.rank();
                // All else stays.
                assert_eq!(chosen.split, None);
                let again = Plan {
                    multiple: plan.multiple,
                    single: plan.single,
                    split: plan.split,
                    ..chosen
                };
                assert_eq!(again, plan);
            }
            let (best, _) = choose(&rows, &plan, 1_000_000, filter).expect("a plan");
            assert!(matches!(best.multiple, Multiple::Mixture(_)), "{name}");
        }
    }
}

/// What budgets 4 to 64 promise of the statue in every light: no noise.
#[test]
fn no_budget_buys_noise() {
    let rows = rows();
    for plan in plans() {
        for budget in 4..=64 {
            let (chosen, _) = choose(&rows, &plan, budget, Filter::Linear).expect("a plan");
            assert!(
                !matches!(chosen.multiple, Multiple::Samples(_)),
                "{budget}: {}",
                chosen.multiple
            );
        }
    }
}

#[test]
fn a_refusal_names_the_smallest_budget() {
    let rows = rows();
    for plan in plans() {
        let Err(Error::TooSmall { least, choice, .. }) = choose(&rows, &plan, 1, Filter::Texels)
        else {
            panic!("one fetch draws nothing");
        };
        let (_, why) = choose(&rows, &plan, least, Filter::Texels).expect("it fits");
        assert_eq!(why.row.choice, choice);
        assert!(choose(&rows, &plan, least - 1, Filter::Texels).is_err());
    }
    // Without a device.
    let folder = folder();
    for (arguments, least) in [("", 2), ("--frames-averaged 2", 3)] {
        let line = format!("render statue-1k -o a.png --fetch-budget 1 {arguments}");
        let ran = run(folder.path(), &line.split_whitespace().collect::<Vec<_>>());
        assert_eq!(ran.code, 2);
        let remedy = format!("give --fetch-budget {least}\n");
        assert!(ran.stderr.ends_with(&remedy), "{}", ran.stderr);
        assert!(ran.stderr.contains("statue-1k in marble") && ran.stderr.lines().count() == 1);
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_scene_file_may_hold_a_budget_and_flags_override_it() {
    let folder = folder();
    let path = file(
        folder.path(),
        "s.toml",
        "mesh = \"statue-1k\"\n[method]\nfetch_budget = 9\nspecular = false\n",
    );
    let request = Request::open(&path).expect("a scene");
    assert_eq!(request.fetch_budget, Some(9));
    if !common::device::present() {
        return;
    }
    let summary = |arguments: &str| {
        let line = format!("render s.toml -o a.png --size 40x30 --stats a.json {arguments}");
        let ran = run(folder.path(), &line.split_whitespace().collect::<Vec<_>>());
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{arguments}");
        let text = std::fs::read_to_string(folder.path().join("a.json")).expect("statistics");
        let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        (ran.stdout, json)
    };
    for (arguments, budget) in [("", 9), ("--fetch-budget 20", 20)] {
        let (stdout, json) = summary(arguments);
        let [of, made] = [&json["method"]["budget"], &json["fetches"]["per_pixel"]];
        assert_eq!(of["fetches"], budget);
        let (expected, worst) = (of["expected_rr"].as_f64(), of["worst_rr"].as_f64());
        assert!(Some(0.0) < expected && expected < worst && worst < Some(1.0));
        assert!(made.as_u64().expect("fetches") <= budget, "{json}");
        for key in ["multiple", "single"] {
            let name = json["method"][key].as_str().expect("a name");
            assert!(stdout.contains(name), "{stdout}");
        }
        assert!(
            stdout.contains(&format!("budget of {budget}: ")),
            "{stdout}"
        );
    }
    let (stdout, json) = summary("--multiple none --single off");
    assert!(json["method"]["budget"].is_null() && !stdout.contains("budget"));
}
