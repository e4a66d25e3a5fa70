//! How the tool meets the workpiece: one contact law at a time.
//!
//! A law is solved once per substep, on one thread, beside the first half of the pass over the nodes, from
//! the same deposits; it says what it changes as `NodalImpulses`, which the chunks add to their nodes.
//! `surface` acts at the material points (solved by `gauss_seidel`, with `sticking` where strength caps
//! friction), `nodal` holds the paper's own laws on nodes shared with `tool_particles`, `nodes_inside` is a
//! plain law for tests. `nodes` is what laws see of points and nodes, `coulomb` is Coulomb's law at a node.
//! Partition and tool lie below and know no law; the simulation holds one `ContactLaw` and no name of any.
//!
//! To add a law: a file here with a type that is a `ContactLaw`, and its line in `law`; a scene's law has a
//! name in `scene::ContactChoice`, too. Its state goes through `save` and `restore`; a list of near points
//! through `note_sort` and `note_motion`. Nothing outside needs to change.

mod contact_law;
mod coulomb;
mod gauss_seidel;
mod nodal;
mod nodes;
mod nodes_inside;
mod sticking;
mod surface;
mod tool_particles;
mod two_fields;

pub use contact_law::{BoxedLaw, ContactCost, ContactLaw, ContactStep, Parting};
pub use nodes_inside::NodesInside;

use crate::contact::nodal::NodalContact;
use crate::contact::surface::SurfaceContact;
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::points::PointState;
use crate::scene::ContactChoice;
use crate::simd::Real;

/// A scene's contact law; `sticking` where the material's shear strength caps friction, which `surface` alone
/// can.
pub fn law<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
    choice: ContactChoice,
    sticking: bool,
) -> BoxedLaw<R, D, F, S> {
    match choice {
        ContactChoice::Surface => Box::new(SurfaceContact::new(sticking)),
        ContactChoice::Distance => Box::new(NodalContact::distance()),
        ContactChoice::Velocity => Box::new(NodalContact::velocity()),
    }
}
