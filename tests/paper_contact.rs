//! The paper's own contact laws in whole cuts (`contact::nodal`); what they must conserve stands in
//! `surface_contact.rs`, Coulomb's law and the first contact in `incline.rs`.

use swarf::scene::ContactChoice::{self, Distance, Surface, Velocity};
use swarf::scene::{Heat, Scene};
use swarf::session::Session;
use swarf::variables::ChipState;

/// A small cut, spacing 40 µm.
fn scene(contact: ContactChoice) -> Scene {
    let mut scene = Scene::default();
    (scene.workpiece.length, scene.workpiece.height) = (2e-3, 8e-4);
    scene.numerics.point_spacing = 4e-5;
    scene.numerics.contact = contact;
    scene
}

/// Runs a cut in two communication steps: 0.5 mm and another 0.5 mm of travel.
fn cut(scene: &Scene) -> Session {
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    session.advance_to(1e-5, &mut |_| true).expect("a stable run");
    session.advance_to(2e-5, &mut |_| true).expect("a stable run");
    session
}

/// Each law forms a chip and keeps the ledger closed (1 %, the bound). Nodes ahead of the tool that
/// it takes along make it blunter, so the laws on nodes need more force than the one at the surface.
#[test]
fn every_law_cuts_and_keeps_its_books() {
    let forces = [Surface, Distance, Velocity].map(|contact| {
        let session = cut(&scene(contact));
        let o = session.outputs();
        println!(
            "{contact:?}: force {} N, thrust {} N, friction {} J of {} J, ledger {}",
            o.cutting_force, o.thrust_force, o.friction_work, o.tool_work, o.balance_error
        );
        assert!(o.balance_error.abs() < 1e-2, "{contact:?}: ledger {}", o.balance_error);
        assert_eq!(o.chip_state, ChipState::Cutting, "{contact:?}: the tool is not cutting");
        assert!(o.friction_work > 0.0, "{contact:?}: friction gave {} J", o.friction_work);
        assert!(o.contact_length > 0.0, "{contact:?}: no contact on the rake face");
        o.cutting_force
    });
    let [surface, distance, velocity] = forces;
    assert!(surface < distance.min(velocity), "forces of surface, distance and velocity: {forces:?} N");
}

/// Friction heat finds its place under these laws too: what workpiece and tool got is the friction work, but
/// for rounding.
#[test]
fn friction_heat_goes_where_it_should() {
    for contact in [Distance, Velocity] {
        let mut scene = scene(contact);
        scene.effects.heat = Heat::Conduction;
        scene.material.name = "custom".into();
        // Only friction heats.
        scene.material.constants.taylor_quinney = 0.0;
        let session = cut(&scene);
        let o = session.outputs();
        let heat = o.thermal_energy + o.tool_heat;
        println!("{contact:?}: heat {heat} J of {} J friction work", o.friction_work);
        assert!(o.tool_heat > 0.0, "{contact:?}: the tool got {} J", o.tool_heat);
        assert!(
            (heat / o.friction_work - 1.0).abs() < 1e-9,
            "{contact:?}: heat {heat} J of {} J",
            o.friction_work
        );
    }
}

/// What the laws do not go with is refused by name, with what is allowed.
#[test]
fn what_does_not_fit_is_refused_by_name() {
    type Change = fn(&mut Scene);
    let refusals: [(Change, &str); 2] = [
        (|s| s.numerics.points_per_cell_edge = 3, "numerics.points_per_cell_edge = 2"),
        (
            |s| {
                s.effects.heat = Heat::Conduction;
                s.effects.tool_heat = true;
            },
            "effects.tool_heat = false",
        ),
    ];
    for (contact, name) in
        [(Distance, "numerics.contact = distance"), (Velocity, "numerics.contact = velocity")]
    {
        for (change, allowed) in refusals {
            let mut scene = scene(contact);
            change(&mut scene);
            let Err(error) = Session::new(&scene, 0.0) else { panic!("{contact:?} goes without {allowed}") };
            let text = error.to_string();
            assert!(text.contains(name) && text.contains(allowed), "{text}");
        }
    }
}
