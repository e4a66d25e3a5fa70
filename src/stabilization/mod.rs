//! What keeps a run sound between the grid and its points: velocities that the grid cannot see, volumetric
//! locking.
//!
//! Both are passes of their own, run when the points have moved by a share of a cell; what they take out of
//! the motion is booked as damping.

pub mod null_space_filter;
pub mod volumetric_locking;
