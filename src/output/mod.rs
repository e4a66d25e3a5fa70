//! What a run hands out: fields of the points, measures of chip and surface, files and pictures.
//!
//! Plain data in, files out: nothing here knows the solver but `survey`, which counts points as the solver
//! shows them, and nothing knows the session. Outputs and their columns are those of `variables`; a new
//! quantity of the points is a field of `PointFields`, filled in by `Session::point_fields` and written by
//! `vtk`.
//!
//! * `point_fields`: the fields of all points at one time;
//! * `survey`: sums over the points: chip temperature, thickness, strains;
//! * `profiles`, `segmentation`: machined surface, rake face, shear bands;
//! * `cell_means`: stress, pressure and strain rate as the points of a cell have them together;
//! * `results`, `vtk`: the files of `results.directory`; `directory_lock`: one run at a time in it;
//! * `plot`: pictures and charts (feature `plot`, no part of the shipped library).
//!
//! What may be touched: a new field of points is an entry of `PointFields` and an array in `vtk`; outputs of
//! the FMU are not made here but in the table of `variables::outputs`.

pub mod point_fields;
pub(crate) mod survey;
pub mod profiles;
pub mod cell_means;
pub mod segmentation;
pub(crate) mod directory_lock;
pub mod results;
pub mod vtk;
#[cfg(feature = "plot")]
pub mod plot;
