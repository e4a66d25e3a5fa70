//! Chips of Ti-6Al-4V at 500 m/min with plain Johnson–Cook and with Sima and Özel's law (book, materials and
//! chips).
//!
//! `cargo run --release --features plot --example titanium_chip -- OUT [NAME=VALUE]...`, with `law`
//! (johnson_cook or johnson_cook_tanh), `spacing` (m), `travel` (m), `speed` (exact, balanced or fast),
//! `heat` (adiabatic or conduction), `damage` (0 or 1). Writes pictures of plastic strain and temperature and
//! a table of the force over travel into OUT.

use std::error::Error;
use std::fmt::Write;
use std::path::PathBuf;

use swarf::Session;
use swarf::output::plot::colours::Colours;
use swarf::output::plot::{FieldPicture, Provenance, View, draw_field};
use swarf::scene::{Heat, Inputs, Law, Scene, Speed};
use swarf::session::Advance;

/// Cutting speed (m/s): 500 m/min.
const SPEED: f64 = 500.0 / 60.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let out = PathBuf::from(words.next().ok_or("usage: titanium_chip OUT [NAME=VALUE]...")?);
    std::fs::create_dir_all(&out)?;
    let mut scene = Scene::default();
    scene.material.name = "Ti-6Al-4V".into();
    scene.material.law = Law::JohnsonCookTanh;
    (scene.workpiece.length, scene.workpiece.height) = (2e-3, 3e-4);
    scene.tool.rake_angle = 0.0;
    scene.tool.clearance_angle = 11_f64.to_radians();
    scene.tool.edge_radius = 5e-6;
    scene.inputs = Inputs { tool_velocity: SPEED, feed: 1e-4, friction: 0.35 };
    scene.numerics.point_spacing = 5e-6;
    scene.numerics.speed = Speed::Fast;
    // A Courant number of one's own keeps `fast` from smoothing increments, which blurs bands; and all of the
    // chip is integrated.
    (scene.numerics.courant, scene.numerics.active_chip) = (0.53, 1000.0);
    let mut travel = 0.8e-3;
    for word in words {
        let (name, value) = word.split_once('=').ok_or("NAME=VALUE is wanted")?;
        match (name, value) {
            ("law", "johnson_cook") => scene.material.law = Law::JohnsonCook,
            ("law", "johnson_cook_tanh") => scene.material.law = Law::JohnsonCookTanh,
            ("speed", "exact") => scene.numerics.speed = Speed::Exact,
            ("speed", "balanced") => scene.numerics.speed = Speed::Balanced,
            ("speed", "fast") => scene.numerics.speed = Speed::Fast,
            ("heat", "adiabatic") => scene.effects.heat = Heat::Adiabatic,
            ("heat", "conduction") => scene.effects.heat = Heat::Conduction,
            ("damage", _) => scene.effects.damage = value == "1",
            ("spacing", _) => scene.numerics.point_spacing = value.parse()?,
            ("travel", _) => travel = value.parse()?,
            _ => return Err(format!("{word}: unknown").into()),
        }
    }
    let law = scene.material.law.name();
    let name = format!("{law}{}", if scene.effects.damage { "_damage" } else { "" });
    let mut session = Session::new(&scene, 0.0)?;
    println!("{}", session.effects_summary());
    const FRAMES: u32 = 80;
    let mut table =
        String::from("travel_mm,cutting_force_N,thrust_force_N,chip_temperature_K,balance_error\n");
    for k in 1..=FRAMES {
        let end = travel / SPEED * f64::from(k) / f64::from(FRAMES);
        if session.advance_to(end, &mut |_| true)? != Advance::Reached {
            return Err("stopped on the way".into());
        }
        let o = session.outputs();
        writeln!(
            table,
            "{:.4},{:.2},{:.2},{:.1},{:.2e}",
            1e3 * SPEED * end,
            o.cutting_force,
            o.thrust_force,
            o.chip_temperature,
            o.balance_error
        )?;
        if k % (FRAMES / 4) == 0 {
            draw(&session, &out, &name, SPEED * end)?;
            println!("{name}: {:.2} mm, {:?}", 1e3 * SPEED * end, session.outputs());
        }
    }
    std::fs::write(out.join(format!("{name}.csv")), table)?;
    Ok(())
}

/// Draws plastic strain and temperature around the tool after a way (m).
fn draw(session: &Session, out: &std::path::Path, name: &str, way: f64) -> Result<(), Box<dyn Error>> {
    let scene = session.scene();
    let fields = session.point_fields();
    let tip = scene.workpiece.length - way;
    let view = View { x: [tip - 0.35e-3, tip + 0.45e-3], y: [0.1e-3, 0.75e-3] };
    let provenance = Provenance {
        footer: format!(
            "Ti-6Al-4V, {}, 500 m/min, feed 0.1 mm, spacing {:.1} µm",
            name,
            1e6 * scene.numerics.point_spacing
        ),
        parameters: Vec::new(),
    };
    let strain = FieldPicture {
        title: &format!("{name}: plastic strain after {:.2} mm", 1e3 * way),
        label: "equivalent plastic strain (-)",
        values: &fields.plastic_strain,
        range: [0.0, 5.0],
        colours: Colours::Viridis,
        view,
        spacing: scene.numerics.point_spacing,
    };
    let file = |what: &str| out.join(format!("{name}_{what}_{:.0}um.png", 1e6 * way));
    draw_field(&file("strain"), &fields, &strain, &provenance)?;
    let celsius: Vec<f64> = fields.temperature.iter().map(|t| t - 273.15).collect();
    let temperature = FieldPicture {
        title: &format!("{name}: temperature after {:.2} mm", 1e3 * way),
        label: "temperature (\u{b0}C)",
        values: &celsius,
        range: [0.0, 1200.0],
        colours: Colours::Inferno,
        ..strain
    };
    draw_field(&file("temperature"), &fields, &temperature, &provenance)?;
    Ok(())
}
