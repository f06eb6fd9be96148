//! A composite as a union of intersections.
//!
//! Every step of a composite spreads over the terms there are:
//!
//! ```text
//!   S = ∪_t ∩_f K_tf         K = a solid, or the complement of one
//!   S + s = S ∪ s            one more term, or into the term that is all of s's axis and turn
//!   S - s = ∪_t (∩_f K_tf ∩ ¬s)
//!   S & s = ∪_t (∩_f K_tf ∩ s)
//! ```
//!
//! so there are never more terms than added solids. Within a term the solids that share axis and
//! turn become one factor, combined in the half-plane, exactly.

use super::body::Body;
use super::coaxial::{Combination, Joined, same_axis, same_turn};
use super::part::{Operation, Part};
use super::turn::Turn;
use crate::math::Aabb;
use crate::math::Side;
use std::sync::Arc;

/// A solid of a term, or its complement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Factor {
    /// Index of the body.
    pub(crate) body: usize,
    /// Whether the term keeps what is outside of the body.
    pub(crate) complement: bool,
}

impl Factor {
    /// The side of a point, from its side of the body.
    #[inline]
    pub(crate) fn side(self, of_body: Side) -> Side {
        if self.complement {
            of_body.opposite()
        } else {
            of_body
        }
    }
}

/// An intersection of factors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Term {
    pub(crate) factors: Vec<Factor>,
}

/// The bodies of a composite and the terms over them.
#[derive(Debug, Clone)]
pub(super) struct Terms {
    pub(super) bodies: Vec<Arc<Body>>,
    pub(super) terms: Vec<Term>,
}

/// A factor before its solids are combined.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Draft {
    steps: Vec<(Operation, usize)>,
    /// The part whose turn is the factor's.
    turned: usize,
}

impl Draft {
    fn new(operation: Operation, part: usize) -> Self {
        Self {
            steps: vec![(operation, part)],
            turned: part,
        }
    }

    /// Whether the steps begin with the whole space and take solids from it.
    fn begins_whole(&self) -> bool {
        self.steps[0].0 != Operation::Add
    }

    /// Whether the factor is the complement of a solid.
    fn complement(&self) -> bool {
        let subtract = |s: &(Operation, usize)| s.0 == Operation::Subtract;
        self.steps.iter().all(subtract)
    }

    /// Takes one more part where that is a step in the half-plane.
    fn take(&mut self, parts: &[Part], operation: Operation, part: usize) -> bool {
        let (own, other) = (&parts[self.turned], &parts[part]);
        if !same_axis(own, other) {
            return false;
        }
        let full = |p: &Part| p.turned().is_some_and(|(_, b)| *b.turn() == Turn::Full);
        let takes = same_turn(own, other)
            // What a full turn takes from part of a turn, it takes in every half-plane of it.
            || operation != Operation::Add && full(other) && !self.complement();
        // Part of a turn kept of a full one is that part of the kept.
        let narrows = operation == Operation::Intersect && full(own) && !self.complement();
        if takes || narrows {
            self.steps.push((operation, part));
        }
        if narrows && !takes {
            self.turned = part;
        }
        takes || narrows
    }
}

impl Draft {
    /// A box around what the factor keeps; `None` where that has no end.
    fn extent(&self, parts: &[Part]) -> Option<Aabb> {
        self.steps
            .iter()
            .fold(None, |extent: Option<Aabb>, &(operation, i)| {
                let other = parts[i].bounds();
                match (operation, extent) {
                    (Operation::Add, Some(e)) => Some(e.union(&other)),
                    (Operation::Add | Operation::Intersect, None) => Some(other),
                    (_, extent) => extent,
                }
            })
    }
}

/// A term before its solids are combined.
type TermDraft = Vec<Draft>;

/// The composite of the parts, in their order.
pub(super) fn terms(parts: &[Part]) -> Terms {
    let mut drafts: Vec<TermDraft> = Vec::new();
    let mut loose = vec![false; parts.len()];
    loop {
        drafts.clear();
        for i in 0..parts.len() {
            step(parts, i, &loose, &mut drafts);
        }
        match built(parts, &drafts) {
            Ok(terms) => return terms,
            // Parts that cannot be sorted out in the half-plane stay apart.
            Err(tangled) => {
                for i in tangled {
                    loose[i] = true;
                }
            }
        }
    }
}

/// Whether the boxes of two solids are apart, with room for their rounding.
fn apart(a: &Aabb, b: &Aabb) -> bool {
    let margin = 1e-9 * a.longest_side().max(b.longest_side());
    (a.min - margin).cmpgt(b.max).any() || (b.min - margin).cmpgt(a.max).any()
}

/// Takes part `i` into the terms.
fn step(parts: &[Part], i: usize, loose: &[bool], drafts: &mut Vec<TermDraft>) {
    let operation = parts[i].operation();
    let disjoint = |term: &TermDraft| {
        let mut extents = term.iter().filter_map(|f| f.extent(parts));
        extents.any(|e| apart(&e, &parts[i].bounds()))
    };
    let tied = |factor: &Draft| loose[i] || factor.steps.iter().any(|s| loose[s.1]);
    match operation {
        Operation::Add => {
            let joins = drafts.iter_mut().any(|term| match term.as_mut_slice() {
                [only] if !only.complement() && !tied(only) => only.take(parts, operation, i),
                _ => false,
            });
            if !joins {
                drafts.push(vec![Draft::new(operation, i)]);
            }
        }
        Operation::Subtract | Operation::Intersect => {
            if operation == Operation::Intersect {
                drafts.retain(|term| !disjoint(term));
            }
            for term in drafts.iter_mut() {
                if operation == Operation::Subtract && disjoint(term) {
                    continue;
                }
                let joins = term
                    .iter_mut()
                    .any(|factor| !tied(factor) && factor.take(parts, operation, i));
                if !joins {
                    term.push(Draft::new(operation, i));
                }
            }
        }
    }
}

/// Combines the drafts; the parts of those that cannot be.
fn built(parts: &[Part], drafts: &[TermDraft]) -> Result<Terms, Vec<usize>> {
    let mut bodies = Vec::new();
    let mut known: Vec<(Draft, Option<usize>)> = Vec::new();
    let mut terms = Vec::new();
    'terms: for draft in drafts {
        let mut factors = Vec::new();
        for factor in draft {
            let complement = factor.complement();
            let body = match known.iter().find(|(d, _)| d == factor) {
                Some((_, body)) => *body,
                None => {
                    let body = combined(parts, factor)?.map(|body| {
                        bodies.push(body);
                        bodies.len() - 1
                    });
                    known.push((factor.clone(), body));
                    body
                }
            };
            match body {
                Some(body) => factors.push(Factor { body, complement }),
                // The complement of nothing is everything.
                None if complement => {}
                None => continue 'terms,
            }
        }
        terms.push(Term { factors });
    }
    Ok(Terms { bodies, terms })
}

fn combined(parts: &[Part], factor: &Draft) -> Result<Option<Arc<Body>>, Vec<usize>> {
    let combination = Combination {
        steps: &factor.steps,
        turned: factor.turned,
        from_whole: factor.begins_whole(),
        complement: factor.complement(),
    };
    match combination.joined(parts) {
        Joined::Solid(body) => Ok(Some(body)),
        Joined::Nothing => Ok(None),
        Joined::Tangled => Err(factor.steps.iter().map(|s| s.1).collect()),
    }
}
