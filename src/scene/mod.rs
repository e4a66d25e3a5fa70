//! What is simulated: every parameter of a scene in SI units, with the reference cut as default.
//!
//! Plain data. Names, units, ranges and texts of the parameters stand in the table of `variables`; what
//! belongs together is checked in `Scene::check`.
//!
//! * this file: the parameters; `lattice`: the points that a block starts as;
//! * `presets`: the price list, error bands and the presets of `numerics.accuracy`; `speed_levels`: what
//!   `numerics.speed` sets.
//!
//! What may be touched: a new parameter is a field here and an entry in a table of `variables`; an item of a
//! choice is always appended, since its number is part of the FMU's interface.

pub mod lattice;
pub mod presets;
pub mod speed_levels;

use serde::{Deserialize, Serialize};

/// An enumeration with the names an FMI importer shows, numbered from 1 in this order.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$item_doc:meta])* $item:ident = $text:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($(#[$item_doc])* $item),+ }

        impl $name {
            /// All items with their names, in FMI order (the first has number 1).
            pub const ALL: &'static [(&'static str, $name)] = &[$(($text, $name::$item)),+];

            /// Name of the item.
            pub fn name(self) -> &'static str { Self::ALL[self as usize].0 }

            /// Number of the item in the FMU's type definition, from 1.
            pub fn number(self) -> i32 { self as i32 + 1 }

            /// The item with an FMI number, if there is one.
            pub fn from_number(number: i32) -> Option<Self> {
                let index = usize::try_from(number.checked_sub(1)?).ok()?;
                Self::ALL.get(index).map(|item| item.1)
            }
        }
    };
}
pub(crate) use choice;

choice! {
    /// Which process is simulated.
    SceneKind {
        /// Orthogonal cutting.
        Cut = "cut",
        /// The paper's pressing process.
        Press = "press",
        /// A cylinder against a rigid wall.
        Taylor = "taylor",
    }
}
choice! {
    /// What heats and where heat goes.
    Heat {
        /// No temperature at all.
        None = "none",
        /// Plastic work heats each point; nothing flows.
        Adiabatic = "adiabatic",
        /// Plastic and friction work heat, and heat flows.
        Conduction = "conduction",
    }
}
choice! {
    /// Flow stress law.
    Law {
        /// Johnson and Cook (1983).
        JohnsonCook = "johnson_cook",
        /// Sima and Özel (2010), with strain softening.
        JohnsonCookTanh = "johnson_cook_tanh",
        /// Zerilli and Armstrong (1987) for bcc metals, rate and temperature coupled.
        ZerilliArmstrong = "zerilli_armstrong",
    }
}
choice! {
    /// Plane strain or three dimensions.
    DimensionChoice {
        /// Two dimensions, no strain across.
        PlaneStrain = "plane_strain",
        /// Three dimensions.
        ThreeDimensional = "three_dimensional",
    }
}
choice! {
    /// Shape function between points and grid.
    ShapeChoice {
        /// The paper's eq. 4.
        Linear = "linear",
        /// Uniform GIMP, the paper's eqs. 13 and 14.
        Gimp = "gimp",
    }
}
choice! {
    /// How velocities go from the grid back to the points.
    TransferChoice {
        /// Increments of the grid velocity (the paper's eq. 17).
        Flip = "flip",
        /// Grid velocity with an affine field around each point (Jiang et al. 2015).
        Apic = "apic",
    }
}
choice! {
    /// How points act on each other and part at the edge.
    Formulation {
        /// Averages over cells; chip and work part at the edge.
        Separated = "separated",
        /// Each point by itself, on one velocity field: the paper's scheme.
        Plain = "plain",
    }
}
choice! {
    /// Contact law between tool and workpiece.
    ContactChoice {
        /// Exact signed distance to the tool.
        Surface = "surface",
        /// The paper's eqs. 19 to 23.
        Distance = "distance",
        /// Bardenhagen's eq. 18.
        Velocity = "velocity",
    }
}
choice! {
    /// Floating-point format of the points and the grid.
    Precision {
        /// 64 bit.
        Double = "double",
        /// 32 bit.
        Single = "single",
    }
}
choice! {
    /// How much accuracy is traded for speed.
    Speed {
        /// Nothing is traded.
        Exact = "exact",
        /// Force within 0.5 %.
        Balanced = "balanced",
        /// Force within 2 %.
        Fast = "fast",
    }
}
choice! {
    /// A point on the front of accuracy against cost.
    Accuracy {
        /// A first look.
        Draft = "draft",
        /// Everyday work.
        Standard = "standard",
        /// Careful work.
        Fine = "fine",
        /// The paper's resolution.
        Paper = "paper",
        /// The single parameters decide.
        Custom = "custom",
    }
}

/// The block that is cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Workpiece {
    /// Length along the cut (m).
    pub length: f64,
    /// Height (m).
    pub height: f64,
    /// Width across the cut (m); scales the forces in plane strain.
    pub width: f64,
    /// Temperature at the start (K).
    pub initial_temperature: f64,
    /// Whether the left side, towards which the tool cuts, is held.
    pub held_side: bool,
    /// Whether fresh material is fed in front of the tool without end.
    pub endless: bool,
    /// Length after which the tool meets its own surface again (m); 0 for never.
    pub revolution_length: f64,
}

/// The rigid tool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tool {
    /// Angle of the rake face to the surface normal (rad), positive when it leans away from the cut.
    pub rake_angle: f64,
    /// Angle between the flank and the machined surface (rad).
    pub clearance_angle: f64,
    /// Radius of the cutting edge (m); 0 for sharp.
    pub edge_radius: f64,
    /// How far the normal of a round edge leans forward from straight down where the material parts (rad).
    pub parting_angle: f64,
    /// Length along the cut (m).
    pub length: f64,
    /// Height (m).
    pub height: f64,
    /// Distance ahead of the workpiece's right side at the start (m).
    pub initial_gap: f64,
    /// Fastest vertical motion when the feed changes (m/s).
    pub feed_rate_limit: f64,
    /// Thermal conductivity (W/(m K)).
    pub conductivity: f64,
    /// Specific heat (J/(kg K)).
    pub specific_heat: f64,
    /// Density (kg/m3).
    pub density: f64,
    /// Conductance of the contact with the workpiece (W/(m2 K)).
    pub contact_conductance: f64,
}

/// Constants of Zerilli and Armstrong's law for bcc metals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ZerilliArmstrong {
    /// C₀: stress that neither rate nor temperature change (Pa).
    pub c0: f64,
    /// C₁: stress at 0 K that heat takes away (Pa).
    pub c1: f64,
    /// C₃: how fast heat takes it away (1/K).
    pub c3: f64,
    /// C₄: how much of it the logarithm of the rate holds (1/K).
    pub c4: f64,
    /// C₅: hardening modulus (Pa).
    pub c5: f64,
    /// n: hardening exponent (-).
    pub n: f64,
}

/// Constants of the workpiece material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Constants {
    /// Density (kg/m3).
    pub density: f64,
    /// Young's modulus (Pa).
    pub youngs_modulus: f64,
    /// Poisson's ratio (-).
    pub poissons_ratio: f64,
    /// Johnson–Cook A (Pa).
    pub yield_stress: f64,
    /// Johnson–Cook B (Pa).
    pub hardening_modulus: f64,
    /// Johnson–Cook n (-).
    pub hardening_exponent: f64,
    /// Johnson–Cook C (-).
    pub rate_coefficient: f64,
    /// Johnson–Cook reference strain rate (1/s).
    pub reference_rate: f64,
    /// Johnson–Cook m (-).
    pub thermal_exponent: f64,
    /// Melting temperature (K).
    pub melting_temperature: f64,
    /// Reference temperature of the thermal softening (K).
    pub reference_temperature: f64,
    /// Specific heat (J/(kg K)).
    pub specific_heat: f64,
    /// Thermal conductivity (W/(m K)).
    pub conductivity: f64,
    /// Linear thermal expansion (1/K).
    pub thermal_expansion: f64,
    /// Share of plastic work that becomes heat (-).
    pub taylor_quinney: f64,
    /// Johnson–Cook damage constants d1 to d5 (-).
    pub damage: [f64; 5],
    /// Energy per area between the initiation of damage and separation (J/m2).
    pub fracture_energy: f64,
    /// Sima and Özel's a, b, c, d and s (-).
    pub tanh: [f64; 5],
    /// Zerilli and Armstrong's.
    pub zerilli_armstrong: ZerilliArmstrong,
}

/// The workpiece material: a name of the library or "custom", and constants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the library, or "custom".
    pub name: String,
    /// Flow stress law.
    pub law: Law,
    /// Constants; they count for "custom".
    pub constants: Constants,
}

/// Which effects the scene calls for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effects {
    /// What heats and where heat goes.
    pub heat: Heat,
    /// Whether the flow stress depends on the strain rate.
    pub rate: bool,
    /// Whether the flow stress depends on the temperature.
    pub thermal_softening: bool,
    /// Whether the tool conducts heat.
    pub tool_heat: bool,
    /// Whether heat makes the material expand.
    pub thermal_expansion: bool,
    /// Whether the material takes damage and separates.
    pub damage: bool,
    /// Whether the friction traction is capped by the shear strength.
    pub sticking: bool,
    /// Whether shocks are damped by artificial viscosity.
    pub artificial_viscosity: bool,
    /// Whether volumetric locking is controlled.
    pub volumetric_locking_control: bool,
}

/// How the scene is computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Numerics {
    /// Plane strain or three dimensions.
    pub dimension: DimensionChoice,
    /// Distance between neighbouring points at the start (m).
    pub point_spacing: f64,
    /// Points along each edge of a cell at the start (-).
    pub points_per_cell_edge: i32,
    /// Linear coefficient of the artificial viscosity (-).
    pub viscosity_linear: f64,
    /// Quadratic coefficient of the artificial viscosity (-).
    pub viscosity_quadratic: f64,
    /// Courant number (-).
    pub courant: f64,
    /// Shape function.
    pub shape_function: ShapeChoice,
    /// Transfer from grid to points.
    pub transfer: TransferChoice,
    /// Contact law.
    pub contact: ContactChoice,
    /// Floating-point format.
    pub precision: Precision,
    /// How much accuracy is traded for speed.
    pub speed: Speed,
    /// Factor on the mass (-); 1 for none, 0 for automatic.
    pub mass_scaling: f64,
    /// Share of the cutting force that automatic mass scaling may change (-).
    pub inertia_error: f64,
    /// Reach of the active window ahead of the tool in feeds (-); 0 for no window.
    pub active_window: f64,
    /// Height of the integrated chip above the tool's lowest point in feeds (-); 0 for the whole chip.
    pub active_chip: f64,
    /// Whether points are moved and strained by smoothed increments.
    pub smoothed_increments: bool,
    /// How points act on each other and part at the edge.
    pub formulation: Formulation,
    /// A point on the front of accuracy against cost.
    pub accuracy: Accuracy,
    /// Threads; 0 for all that pay.
    pub threads: i32,
    /// Wall time a call may take (s); 0 for any.
    pub wall_time_limit: f64,
    /// Points at rest that a core moves in a second (1/s), for the estimate of a run's cost.
    pub point_rate: f64,
}

impl Numerics {
    /// Length of a cell (m).
    pub fn cell(&self) -> f64 {
        self.point_spacing * f64::from(self.points_per_cell_edge)
    }

    /// Whether cells are averaged and chip and work part at the edge: the formulation asks for it, and needs
    /// contact at the points and a shape function whose points reach around them.
    pub fn separates(&self) -> bool {
        self.formulation == Formulation::Separated
            && self.contact == ContactChoice::Surface
            && self.shape_function == ShapeChoice::Gimp
    }

    /// Whether increments can be smoothed: whether nodes keep the masses that they share
    /// (`partition::smoothing`), and stand in one field.
    pub fn can_smooth(&self) -> bool {
        !self.separates()
            && self.dimension == DimensionChoice::PlaneStrain
            && self.shape_function == ShapeChoice::Gimp
            && self.transfer == TransferChoice::Flip
    }
}

/// Files written while the scene runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Where files are written; empty for nowhere.
    pub directory: String,
    /// Simulated time between two files (s).
    pub interval: f64,
}

/// Inputs, which may change at every communication point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Cutting speed (m/s), positive towards -x.
    pub tool_velocity: f64,
    /// Depth of the tool's lowest point below the workpiece's top (m); negative where it is lifted clear.
    pub feed: f64,
    /// Coulomb coefficient (-).
    pub friction: f64,
}

/// Everything that defines a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Names and values as one text, taken over before the scene is built (`variables::settings`).
    pub settings: String,
    /// Which process.
    pub kind: SceneKind,
    /// The block that is cut.
    pub workpiece: Workpiece,
    /// The rigid tool.
    pub tool: Tool,
    /// The workpiece's material.
    pub material: Material,
    /// Which effects run.
    pub effects: Effects,
    /// How it is computed.
    pub numerics: Numerics,
    /// Files written.
    pub results: Results,
    /// Start values of the inputs.
    pub inputs: Inputs,
}

impl Default for Scene {
    /// The reference cut: AISI 4340, feed 0.3 mm, friction 0.2, 50 m/s (Ambati et al. 2011, section 3.2).
    fn default() -> Self {
        Scene {
            settings: String::new(),
            kind: SceneKind::Cut,
            workpiece: Workpiece {
                length: 3e-3,
                height: 1e-3,
                width: 1e-3,
                initial_temperature: 298.15,
                held_side: true,
                endless: false,
                revolution_length: 0.0,
            },
            tool: Tool {
                rake_angle: 0.0,
                clearance_angle: 0.0873,
                edge_radius: 0.0,
                // Where the cutting force is least.
                parting_angle: 35.0 * std::f64::consts::PI / 180.0,
                length: 5e-4,
                height: 1e-3,
                initial_gap: 1e-6,
                feed_rate_limit: 10.0,
                // Tungsten carbide; used by the tool-heat effect only.
                conductivity: 46.0,
                specific_heat: 203.0,
                density: 15_700.0,
                // Assumed: of the size that finite element studies of cutting fit, which scatter over two
                // orders; at it a cell of 0.02 mm resists as much as the contact does, and more changes
                // little.
                contact_conductance: 1e6,
            },
            material: Material {
                name: "AISI 4340".into(),
                law: Law::JohnsonCook,
                constants: Constants {
                    density: 7830.0,
                    youngs_modulus: 207e9,
                    poissons_ratio: 0.3,
                    yield_stress: 792e6,
                    hardening_modulus: 510e6,
                    hardening_exponent: 0.26,
                    rate_coefficient: 0.014,
                    reference_rate: 1.0,
                    thermal_exponent: 1.03,
                    melting_temperature: 1573.15,
                    reference_temperature: 298.15,
                    specific_heat: 480.0,
                    conductivity: 44.0,
                    thermal_expansion: 1.35e-5,
                    taylor_quinney: 0.9,
                    // Johnson and Cook (1985), table for 4340.
                    damage: [0.05, 3.44, -2.12, 0.002, 0.61],
                    fracture_energy: 1.1e4,
                    // The published set is for Ti-6Al-4V; the law of 4340 is another.
                    tanh: [2.0, 5.0, 2.0, 1.0, 0.05],
                    // The published set is for AISI 1045.
                    zerilli_armstrong: ZerilliArmstrong {
                        c0: 159.2e6,
                        c1: 1533.7e6,
                        c3: 0.00609,
                        c4: 0.000189,
                        c5: 742.6e6,
                        n: 0.171,
                    },
                },
            },
            effects: Effects {
                heat: Heat::Adiabatic,
                rate: true,
                thermal_softening: true,
                tool_heat: false,
                thermal_expansion: false,
                damage: false,
                sticking: false,
                artificial_viscosity: false,
                volumetric_locking_control: true,
            },
            numerics: Numerics {
                dimension: DimensionChoice::PlaneStrain,
                point_spacing: 1e-5,
                points_per_cell_edge: 2,
                viscosity_linear: 0.06,
                viscosity_quadratic: 1.2,
                courant: 0.5,
                shape_function: ShapeChoice::Gimp,
                transfer: TransferChoice::Flip,
                contact: ContactChoice::Surface,
                precision: Precision::Double,
                speed: Speed::Exact,
                mass_scaling: 1.0,
                inertia_error: 0.005,
                active_window: 0.0,
                active_chip: 0.0,
                smoothed_increments: false,
                formulation: Formulation::Separated,
                accuracy: Accuracy::Custom,
                threads: 0,
                wall_time_limit: 0.0,
                // Of the size of what `cargo xtask bench` measured in the plane (results/speed.csv).
                point_rate: 5e7,
            },
            results: Results { directory: String::new(), interval: 1e-6 },
            inputs: Inputs { tool_velocity: 50.0, feed: 3e-4, friction: 0.2 },
        }
    }
}
