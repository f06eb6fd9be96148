//! Orders of convergence.

/// The power p of the least-squares line log e = p log h + c through points (h, e), those of an
/// error below `least` left out; `None` where fewer than two spacings are left.
///
/// ```
/// let points = [[0.5, 0.75], [0.25, 0.1875], [0.125, 0.046875]];
/// let order = voxlathe::converge::order(&points, 0.0).expect("three points");
/// assert!((order - 2.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn order(points: &[[f64; 2]], least: f64) -> Option<f64> {
    let usable = |p: &&[f64; 2]| p[0] > 0.0 && p[1] > least.max(0.0) && p[1].is_finite();
    let logs: Vec<[f64; 2]> = points
        .iter()
        .filter(usable)
        .map(|p| p.map(f64::ln))
        .collect();
    #[allow(clippy::cast_precision_loss, reason = "a count of rows")]
    let count = logs.len() as f64;
    let mean = |c: usize| logs.iter().map(|p| p[c]).sum::<f64>() / count;
    let (h, e) = (mean(0), mean(1));
    let across: f64 = logs.iter().map(|p| (p[0] - h) * (p[0] - h)).sum();
    let along: f64 = logs.iter().map(|p| (p[0] - h) * (p[1] - e)).sum();
    // Two rows of one spacing say nothing.
    (logs.len() >= 2 && across > 1e-12).then(|| along / across)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_fitted_has_no_order() {
        assert_eq!(order(&[], 0.0), None);
        assert_eq!(order(&[[0.5, 0.1]], 0.0), None);
        assert_eq!(order(&[[0.5, 0.1], [0.5, 0.2]], 0.0), None);
        assert_eq!(order(&[[0.5, 1e-16], [0.25, 1e-17]], 1e-12), None);
        assert_eq!(order(&[[0.5, 0.0], [0.25, 0.0], [0.125, 0.1]], 0.0), None);
        let noisy = [
            [1.0, 1.1],
            [0.5, 0.45],
            [0.25, 0.26],
            [0.125, 0.0],
            [0.125, 0.12],
        ];
        let found = order(&noisy, 0.0).expect("four points");
        assert!((found - 1.0).abs() < 0.1, "{found}");
    }
}
