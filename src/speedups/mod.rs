//! Levers of speed, each with its price: scaled mass, an active window, a chip whose far end is rigid.
//!
//! Each is an option of the main loop (`simulation::Options`) and costs nothing where a scene does not take
//! it. The levels of `numerics.speed` that set them together stand in `scene::speed_levels`.

pub mod mass_scaling;
pub mod active_window;
pub mod rigid_chip;
