//! Friction that the shear strength of the touching material caps.
//!
//! Along the face the traction follows Zorev's law,
//!
//! τ = min(μ p, k), with the shear strength k = σ_y/√3 of the flow stress σ_y of the material that touches
//! (von Mises),
//!
//! so material close to the edge, where the pressure is high, sticks to the tool and shears within, and
//! slides further up.
//!
//! Footprint of a point: the part of the face that is nearer to it than to another touching point. Along the
//! outline of the tool it ends halfway to each neighbour; at the end of the contact, where the next touching
//! point is more than `GAP` away, half a point's width from it. In space the face is cut across z into strips
//! as wide as a point, and points have neighbours in their own strip. So footprints cover the contact once,
//! however the points lie.
//!
//! Cap: in the sweeps (`contact::gauss_seidel`) a point obeys |j_t| ≤ μ_p j_n, with its present normal
//! impulse and
//!
//! μ_p = min(μ, Σ_q K_pq k_q a_q Δt/P_q),   P_q = Σ_p K_pq j_np,   K_pq = max(0, 1 − |s_p − s_q|/L),
//!
//! that is, what footprint q can carry, k_q a_q Δt, is shared out among the points within a cell L along the
//! outline, in proportion to their pushes: together they drag at most Σ k a Δt, whoever pushes. Where all
//! push alike this is |j_t| ≤ k a Δt at each. There are more points than nodes, so what a single one pushes
//! is not determined, only the sum over a cell is, and often every other point carries the push of two: a cap
//! on each point by itself would be too low.
//!
//! Source: Zorev (1963), Inter-relationship between shear processes occurring along tool face and shear plane
//! in metal cutting; the paper names the law as what is missing (Ambati et al. 2011, section 4).
//!
//! Form of the effect: optional; a scene without it keeps no array and the sweeps take the scene's μ.

use crate::contact::gauss_seidel::ContactPoint;
use crate::partition::nodes::ContactAreas;

/// Touching points further apart than this (cells) have a gap in the contact between them.
const GAP: f64 = 2.0;
/// A push (N s) that is none: one over it is still a number.
const LEAST_PUSH: f64 = 1e-280;
/// Friction below this part of Coulomb's bound is not sliding's (-).
pub(super) const SLIDING: f64 = 1.0 - 1e-9;

/// Gives the shear strength (Pa) of the point at a lane of a state.
pub type Strength<'a, S> = dyn Fn(&S, usize) -> f64 + 'a;

/// What the cap needs to know of a touching point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layer {
    /// Place along the tool's outline (m).
    pub(super) along: f64,
    /// Number of its strip across z, 0 in the plane.
    pub(super) strip: i64,
    /// The point's width (m).
    pub(super) width: f64,
    /// How far its footprint reaches across the plane (m).
    pub(super) depth: f64,
    /// Shear strength k (Pa).
    pub(super) strength: f64,
}

/// A touching point among its neighbours.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Its number.
    number: u32,
    /// The places within a cell of it: the first, and where they end.
    first: u32,
    end: u32,
    /// Coordinate along the outline (m).
    along: f64,
    /// Footprint (m2), and what it can carry (N).
    area: f64,
    capacity: f64,
}

/// The touching points as neighbours on the face.
#[derive(Clone, Debug, Default)]
pub(super) struct Sticking {
    /// The points by number.
    layers: Vec<Layer>,
    /// The points strip by strip along the outline.
    places: Vec<Place>,
    /// Normal impulses (N s) by place, and what is shared out of each footprint per push.
    pushes: Vec<f64>,
    shares: Vec<f64>,
}

impl Sticking {
    /// Asks for memory for so many points.
    pub(super) fn reserve(&mut self, room: usize) {
        self.layers.reserve(room);
        self.places.reserve(room);
        self.pushes.reserve(room);
        self.shares.reserve(room);
    }

    /// Forgets all points.
    pub(super) fn clear(&mut self) {
        self.layers.clear();
    }

    /// Adds the next touching point.
    pub(super) fn push(&mut self, layer: Layer) {
        self.layers.push(layer);
    }

    /// Finds neighbours and footprints; `cell` is the cell length (m).
    pub(super) fn measure(&mut self, cell: f64) {
        let Sticking { layers, places, .. } = self;
        places.clear();
        places.extend(layers.iter().zip(0..).map(|(layer, number)| Place {
            number,
            first: 0,
            end: 0,
            along: layer.along,
            area: 0.0,
            capacity: 0.0,
        }));
        let layer = |place: &Place| layers[place.number as usize];
        places.sort_unstable_by(|a, b| {
            let strips = layer(a).strip.cmp(&layer(b).strip);
            strips.then(a.along.total_cmp(&b.along)).then(a.number.cmp(&b.number))
        });
        let (mut first, mut before) = (0, None);
        for k in 0..places.len() {
            let own = layer(&places[k]);
            let gap = |other: Option<&Place>| {
                other
                    .filter(|other| layer(other).strip == own.strip)
                    .map(|other| (other.along - own.along).abs())
                    .filter(|&gap| gap <= GAP * cell)
                    .unwrap_or(own.width)
            };
            // Half of what lies between two neighbours belongs to each; an end reaches half a width.
            let length = 0.5 * (gap(before.as_ref()) + gap(places.get(k + 1)));
            let is_near =
                |other: &Place| layer(other).strip == own.strip && (other.along - own.along).abs() < cell;
            while !is_near(&places[first]) {
                first += 1;
            }
            let count = places[k..].iter().take_while(|other| is_near(other)).count();
            let place = &mut places[k];
            (place.first, place.end) = (first as u32, (k + count) as u32);
            place.area = length * own.depth;
            place.capacity = place.area * own.strength;
            before = Some(*place);
        }
    }

    /// Lowers the points' coefficients of friction to what their strength lets them carry, by their present
    /// impulses.
    ///
    /// * `friction`: μ (-); `cell`: L (m); `dt`: substep (s)
    pub(super) fn cap(&mut self, touches: &mut [ContactPoint], friction: f64, cell: f64, dt: f64) {
        self.share_out(touches, cell, |place| place.capacity * dt);
        for place in &self.places {
            let strength = self.near(place, cell, &self.shares);
            touches[place.number as usize].friction = friction.min(strength);
        }
    }

    /// Areas of the contact; friction is below Coulomb's where it is capped, or where the point is at rest on
    /// the face.
    ///
    /// Footprints count for the points that share them.
    pub(super) fn areas(&mut self, touches: &[ContactPoint], friction: f64, cell: f64) -> ContactAreas {
        self.share_out(touches, cell, |place| place.area);
        let mut areas = ContactAreas::default();
        for (place, &push) in self.places.iter().zip(&self.pushes) {
            let area = push * self.near(place, cell, &self.shares);
            areas.all += area;
            if touches[place.number as usize].drag() < SLIDING * friction * push {
                areas.sticking += area;
            }
        }
        areas
    }

    /// By place: the push, and `value` over the push P.
    fn share_out(&mut self, touches: &[ContactPoint], cell: f64, value: impl Fn(&Place) -> f64) {
        let (mut pushes, mut shares) = (std::mem::take(&mut self.pushes), std::mem::take(&mut self.shares));
        pushes.clear();
        pushes.extend(self.places.iter().map(|place| touches[place.number as usize].push_along_normal()));
        shares.clear();
        shares.extend(self.places.iter().map(|place| {
            // Where nothing pushes yet nothing is capped.
            value(place) / self.near(place, cell, &pushes).max(LEAST_PUSH)
        }));
        (self.pushes, self.shares) = (pushes, shares);
    }

    /// Σ_q K_pq times the numbers of the places within a cell.
    #[inline(always)]
    fn near(&self, place: &Place, cell: f64, numbers: &[f64]) -> f64 {
        let range = place.first as usize..place.end as usize;
        let weight = |other: &Place| 1.0 - (other.along - place.along).abs() / cell;
        self.places[range.clone()].iter().zip(&numbers[range]).map(|(other, n)| weight(other) * n).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELL: f64 = 2.0;

    fn layers(places: &[f64]) -> Sticking {
        let mut sticking = Sticking::default();
        for &along in places {
            sticking.push(Layer { along, width: 1.0, depth: 0.5, strength: 3.0, ..Layer::default() });
        }
        sticking.measure(CELL);
        sticking
    }

    fn pushing(pushes: &[f64]) -> Vec<ContactPoint> {
        let touch = |&push: &f64| ContactPoint {
            normal: [0.0, 1.0, 0.0],
            impulse: [0.0, push, 0.0],
            ..ContactPoint::default()
        };
        pushes.iter().map(touch).collect()
    }

    /// However points lie, their footprints cover the contact once: from half a width before the first to
    /// half a width behind the last, less what lies in gaps. Places and widths are halves, so that sums are
    /// exact.
    #[test]
    fn footprints_cover_the_contact_once() {
        for (places, length) in [
            (&[0.0, 1.0, 2.0, 3.0][..], 4.0),
            (&[3.0, 0.0, 0.5, 2.5][..], 4.0),
            (&[0.0, 1.0, 11.0][..], 3.0),
            (&[7.0][..], 1.0),
            (&[2.0, 2.0][..], 1.0),
        ] {
            let sticking = layers(places);
            let area: f64 = sticking.places.iter().map(|place| place.area).sum();
            assert_eq!(area, 0.5 * length, "footprints {:?} m2 at {places:?}", sticking.places);
        }
        let mut apart = Sticking::default();
        for strip in [1, 0] {
            apart.push(Layer { strip, width: 1.0, depth: 1.0, ..Layer::default() });
        }
        apart.measure(CELL);
        assert!(apart.places.iter().all(|place| place.area == 1.0), "points in two strips are no neighbours");
    }

    /// Together the points may drag strength times area, whoever pushes; and a push too low for the cap
    /// leaves Coulomb's coefficient.
    #[test]
    fn the_cap_is_strength_times_area_whoever_pushes() {
        let places: Vec<f64> = (0..40).map(f64::from).collect();
        let mut sticking = layers(&places);
        let mut capped = |friction: f64, push: &dyn Fn(usize) -> f64| {
            let mut touches = pushing(&(0..40).map(push).collect::<Vec<_>>());
            sticking.cap(&mut touches, friction, CELL, 0.1);
            touches
        };
        let patterns: [(&str, &dyn Fn(usize) -> f64); 4] = [
            ("all", &|_| 10.0),
            ("every other", &|k| 20.0 * (k % 2) as f64),
            ("every third", &|k| if k % 3 == 0 { 30.0 } else { 0.0 }),
            ("uneven", &|k| 10.0 + 9.0 * (k as f64 * 1.7).sin()),
        ];
        for (name, push) in patterns {
            let touches = capped(50.0, push);
            let drag: f64 = touches.iter().map(|touch| touch.friction * touch.push_along_normal()).sum();
            // Strength, depth, forty widths, substep; some hundred roundings.
            let expected = 3.0 * 0.5 * 40.0 * 0.1;
            assert!((drag / expected - 1.0).abs() < 1e-13, "{name}: {drag} N s instead of {expected}");
        }
        assert!(
            capped(0.5, &|_| 0.2).iter().all(|touch| touch.friction == 0.5),
            "0.5 · 0.2 is below 3 · 0.5 · 0.1"
        );
    }
}
