//! Where a substep's time goes, and how it compares with the plain loop: measured on a block with a yielding
//! band.
//!
//! Substeps are timed one by one and told apart by what the solver's progress shows: a sort sets the travel
//! back, and so does the locking control with its own. The nodes' share is the time of substeps of the same
//! partition without its points.

use crate::blocks::{MOTION, sheared, sheared_plain};
use cpu_time::ThreadTime;
use serde_json::{Value, json};
use swarf::dimension::{Dimension, PlaneStrain};
use swarf::simd::InstructionSet;
use swarf::simulation::Solver;
use swarf::stabilization::volumetric_locking::LockingControl;

/// Median of some numbers; zero of none.
pub fn median(numbers: &mut [f64]) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
}

/// CPU nanoseconds per point and substep.
pub struct Phases {
    /// Points, and substeps measured.
    points: usize,
    substeps: usize,
    /// An ordinary substep, and its nodes.
    ordinary: f64,
    nodes: f64,
    /// What a sort costs when it happens: all of it, and sorting alone (the rest is the deposit after it).
    sort: f64,
    sorting_alone: f64,
    /// What a look of the locking control costs when it happens.
    control: f64,
    /// Sorts and looks per substep.
    sorts: f64,
    controls: f64,
}

impl Phases {
    /// Measures plane strain in double precision on one thread.
    pub fn measure<D: Dimension>(cells: [i32; 3], substeps: usize) -> Self {
        let mut solver = sheared::<f64, D>(cells);
        solver.locking_control = Some(LockingControl::default());
        let points = solver.points();
        let per_point = |seconds: f64| seconds * 1e9 / points as f64;
        let (mut ordinary, mut sorting, mut controlling) = (vec![], vec![], vec![]);
        for _ in 0..substeps {
            let travel = (solver.progress.travel, solver.progress.travel_uncontrolled);
            let begin = ThreadTime::now();
            solver.step(&MOTION, false).expect("a stable block");
            let time = per_point(begin.elapsed().as_secs_f64());
            let has_controlled = solver.progress.travel_uncontrolled < travel.1;
            match (solver.progress.travel < travel.0, has_controlled) {
                (true, false) => sorting.push(time),
                (false, true) => controlling.push(time),
                (false, false) => ordinary.push(time),
                // Both at once tell neither.
                (true, true) => {}
            }
        }
        let (sorts, controls) = (sorting.len() as f64, controlling.len() as f64);
        let usual = median(&mut ordinary);
        let mut alone: Vec<f64> = (0..9)
            .map(|_| {
                let begin = ThreadTime::now();
                solver.partition.sort(|_, _| {}, false);
                per_point(begin.elapsed().as_secs_f64())
            })
            .collect();
        for chunk in &mut solver.partition.chunks {
            chunk.blocks.clear();
        }
        let mut nodes: Vec<f64> = (0..50)
            .map(|_| {
                let begin = ThreadTime::now();
                solver.step(&MOTION, false).expect("nothing moves");
                per_point(begin.elapsed().as_secs_f64())
            })
            .collect();
        Phases {
            points,
            substeps,
            ordinary: usual,
            nodes: median(&mut nodes),
            sort: (median(&mut sorting) - usual).max(0.0),
            sorting_alone: median(&mut alone),
            control: (median(&mut controlling) - usual).max(0.0),
            sorts: sorts / substeps as f64,
            controls: controls / substeps as f64,
        }
    }

    /// Prints them.
    pub fn print(&self) {
        let Phases { ordinary, nodes, sort, sorting_alone, control, sorts, controls, .. } = self;
        let all = ordinary + sorts * sort + controls * control;
        println!(
            "time by phase, {} points, {} substeps, one thread (ns per point and substep):",
            self.points, self.substeps
        );
        let line = |name: &str, each: f64, share: f64| {
            println!(
                "  {name:<34} {each:7.2} when it happens {:7.2} on average {:5.1} %",
                share,
                100.0 * share / all
            );
        };
        line("points pass", ordinary - nodes, ordinary - nodes);
        line("nodes", *nodes, *nodes);
        line("sort and deposit after it", *sort, sorts * sort);
        line("  of which sorting (undisturbed order)", *sorting_alone, sorts * sorting_alone);
        line("locking control", *control, controls * control);
    }

    /// The same for the file.
    pub fn to_json(&self) -> Value {
        json!({
            "points": self.points,
            "substeps": self.substeps,
            "points_pass_ns": self.ordinary - self.nodes,
            "nodes_ns": self.nodes,
            "sort_and_deposit_ns": self.sort,
            "sort_alone_ns": self.sorting_alone,
            "locking_control_ns": self.control,
            "sorts_per_substep": self.sorts,
            "locking_controls_per_substep": self.controls,
        })
    }
}

/// Point-steps per CPU second of the plain loop and of the kernels on the same block, by turns.
pub struct Comparison {
    points: usize,
    plain: f64,
    /// By instruction set.
    fast: Vec<(&'static str, f64)>,
}

impl Comparison {
    /// Measures plane strain in double precision on one thread.
    pub fn measure(cells: [i32; 3], rounds: usize) -> Self {
        const SUBSTEPS: usize = 10;
        let mut plain = sheared_plain(cells);
        let sets: Vec<_> = InstructionSet::ALL.into_iter().filter(|set| set.is_available()).collect();
        let mut solvers: Vec<_> = sets
            .iter()
            .map(|&set| {
                let mut solver = sheared::<f64, PlaneStrain>(cells);
                solver.options.instructions = set;
                solver
            })
            .collect();
        let points = plain.points.count();
        let mut times = vec![vec![]; 1 + sets.len()];
        for _ in 0..rounds {
            let begin = ThreadTime::now();
            (0..SUBSTEPS).for_each(|_| plain.step(&MOTION));
            times[0].push(begin.elapsed().as_secs_f64());
            for (solver, times) in solvers.iter_mut().zip(&mut times[1..]) {
                let begin = ThreadTime::now();
                (0..SUBSTEPS).for_each(|_| solver.step(&MOTION, false).expect("a stable block"));
                times.push(begin.elapsed().as_secs_f64());
            }
        }
        let rates: Vec<f64> =
            times.iter_mut().map(|times| (points * SUBSTEPS) as f64 / median(times)).collect();
        let fast = sets.iter().zip(&rates[1..]).map(|(set, &rate)| (set.name(), rate)).collect();
        Comparison { points, plain: rates[0], fast }
    }

    /// Point-steps per CPU second of the plain loop.
    pub fn plain_rate(&self) -> f64 {
        self.plain
    }

    /// Prints it.
    pub fn print(&self) {
        println!("the same block of {} points, one thread, without locking control:", self.points);
        println!("  plain loop       {:6.2} M point-steps per CPU second", self.plain / 1e6);
        for (name, rate) in &self.fast {
            println!("  {name:<16} {:6.2} M, {:.2} times the plain loop", rate / 1e6, rate / self.plain);
        }
    }

    /// The same for the file.
    pub fn to_json(&self) -> Value {
        let fast: serde_json::Map<String, Value> =
            self.fast.iter().map(|(name, rate)| ((*name).to_string(), json!(rate))).collect();
        json!({"points": self.points, "plain_loop_per_s": self.plain, "kernels_per_s": fast})
    }
}
