//! Units of the variables, with their SI base-unit exponents and the display units people use.
//!
//! A display value is factor · value + offset, the value in the unit itself; FMI 2.0.4, section 2.2.3.

/// A unit of a Real variable. All are coherent SI units, so factor 1 and offset 0 against the base units.
#[derive(Debug, PartialEq)]
pub struct Unit {
    /// Name as shown to the user and written to the description.
    pub name: &'static str,
    /// Exponents of kg, m, s, K and rad.
    pub exponents: Exponents,
    /// Other units to show values in.
    pub displays: &'static [Display],
}

/// Exponents of the SI base units that the variables need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exponents {
    /// Kilogram.
    pub kg: i32,
    /// Metre.
    pub m: i32,
    /// Second.
    pub s: i32,
    /// Kelvin.
    pub k: i32,
    /// Radian.
    pub rad: i32,
}

/// A unit to show values in.
#[derive(Debug, PartialEq)]
pub struct Display {
    /// Name of the display unit.
    pub name: &'static str,
    /// Display value per value (-).
    pub factor: f64,
    /// Display value at value 0 (display unit).
    pub offset: f64,
}

impl Display {
    const fn scaled(name: &'static str, factor: f64) -> Self {
        Display { name, factor, offset: 0.0 }
    }

    /// The value in the unit itself that shows as `shown`.
    pub fn to_unit(&self, shown: f64) -> f64 {
        (shown - self.offset) / self.factor
    }
}

const fn exponents(kg: i32, m: i32, s: i32, k: i32, rad: i32) -> Exponents {
    Exponents { kg, m, s, k, rad }
}

const fn unit(name: &'static str, exponents: Exponents, displays: &'static [Display]) -> Unit {
    Unit { name, exponents, displays }
}

/// No unit.
pub static ONE: Unit = unit("1", exponents(0, 0, 0, 0, 0), &[Display::scaled("%", 100.0)]);
/// Length.
pub static METRE: Unit =
    unit("m", exponents(0, 1, 0, 0, 0), &[Display::scaled("mm", 1e3), Display::scaled("µm", 1e6)]);
/// Time.
pub static SECOND: Unit = unit(
    "s",
    exponents(0, 0, 1, 0, 0),
    &[Display::scaled("ms", 1e3), Display::scaled("µs", 1e6), Display::scaled("ns", 1e9)],
);
/// Velocity; machine shops count in metres per minute.
pub static METRE_PER_SECOND: Unit = unit("m/s", exponents(0, 1, -1, 0, 0), &[Display::scaled("m/min", 60.0)]);
/// Angle.
pub static RADIAN: Unit =
    unit("rad", exponents(0, 0, 0, 0, 1), &[Display::scaled("deg", 180.0 / std::f64::consts::PI)]);
/// Absolute temperature.
pub static KELVIN: Unit =
    unit("K", exponents(0, 0, 0, 1, 0), &[Display { name: "degC", factor: 1.0, offset: -273.15 }]);
/// Force.
pub static NEWTON: Unit = unit("N", exponents(1, 1, -2, 0, 0), &[Display::scaled("kN", 1e-3)]);
/// Energy.
pub static JOULE: Unit = unit("J", exponents(1, 2, -2, 0, 0), &[Display::scaled("mJ", 1e3)]);
/// Power.
pub static WATT: Unit = unit("W", exponents(1, 2, -3, 0, 0), &[Display::scaled("kW", 1e-3)]);
/// Stress and stiffness.
pub static PASCAL: Unit =
    unit("Pa", exponents(1, -1, -2, 0, 0), &[Display::scaled("MPa", 1e-6), Display::scaled("GPa", 1e-9)]);
/// Energy per volume.
pub static JOULE_PER_CUBIC_METRE: Unit =
    unit("J/m3", exponents(1, -1, -2, 0, 0), &[Display::scaled("J/mm3", 1e-9)]);
/// Energy per area.
pub static JOULE_PER_SQUARE_METRE: Unit =
    unit("J/m2", exponents(1, 0, -2, 0, 0), &[Display::scaled("kJ/m2", 1e-3)]);
/// Mass density.
pub static KILOGRAM_PER_CUBIC_METRE: Unit =
    unit("kg/m3", exponents(1, -3, 0, 0, 0), &[Display::scaled("g/cm3", 1e-3)]);
/// Specific heat capacity.
pub static JOULE_PER_KILOGRAM_KELVIN: Unit = unit("J/(kg.K)", exponents(0, 2, -2, -1, 0), &[]);
/// Thermal conductivity.
pub static WATT_PER_METRE_KELVIN: Unit = unit("W/(m.K)", exponents(1, 1, -3, -1, 0), &[]);
/// Thermal contact conductance.
pub static WATT_PER_SQUARE_METRE_KELVIN: Unit = unit("W/(m2.K)", exponents(1, 0, -3, -1, 0), &[]);
/// Thermal expansion; as a difference, so without the offset of degrees Celsius.
pub static PER_KELVIN: Unit = unit("1/K", exponents(0, 0, 0, -1, 0), &[]);
/// Strain rate.
pub static PER_SECOND: Unit = unit("1/s", exponents(0, 0, -1, 0, 0), &[]);

/// All units, in the order of the description.
pub static ALL: &[&Unit] = &[
    &ONE,
    &METRE,
    &SECOND,
    &METRE_PER_SECOND,
    &RADIAN,
    &KELVIN,
    &NEWTON,
    &JOULE,
    &WATT,
    &PASCAL,
    &JOULE_PER_CUBIC_METRE,
    &KILOGRAM_PER_CUBIC_METRE,
    &JOULE_PER_KILOGRAM_KELVIN,
    &WATT_PER_METRE_KELVIN,
    &WATT_PER_SQUARE_METRE_KELVIN,
    &PER_KELVIN,
    &PER_SECOND,
    &JOULE_PER_SQUARE_METRE,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Showing a value and reading it back is the identity, up to rounding of one product and one sum.
    #[test]
    fn display_units_invert() {
        for unit in ALL {
            for display in unit.displays {
                for value in [0.0, 1.0, -3.7e-4, 298.15] {
                    let back = display.to_unit(display.factor * value + display.offset);
                    let tolerance = 4.0 * f64::EPSILON * (f64::abs(value) + f64::abs(display.offset));
                    assert!((back - value).abs() <= tolerance, "{value} {} became {back}", unit.name);
                }
            }
        }
    }

    /// 25 degrees Celsius is 298.15 K and 180 degrees are π by definition.
    #[test]
    fn well_known_conversions_hold() {
        assert_eq!(KELVIN.displays[0].to_unit(25.0), 298.15);
        assert_eq!(RADIAN.displays[0].to_unit(180.0), std::f64::consts::PI);
        assert_eq!(METRE.displays[0].to_unit(0.3), 3e-4);
    }
}
