//! Speed-ups, each with its price: scaled mass, an active window, a chip whose far end is rigid.
//!
//! Each is an option of the main loop (`simulation::Options`) and costs nothing where a scene does not take
//! it. The levels of `numerics.speed` that set them together stand in `scene::speed_levels`.
//!
//! What may be touched: the accuracy of a speed-up is measured before its level takes it (`cargo xtask bench
//! --row levels`); what it keeps between substeps is saved in `Progress`.

pub(crate) mod mass_scaling;
pub(crate) mod active_window;
pub(crate) mod rigid_chip;
