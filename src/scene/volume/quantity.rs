//! What a volume's values are, as far as its file says so. A scene made for a bare volume follows from it.

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Hounsfield units of a CT: −1000 is air, 0 is water.
    Hounsfield,
    /// Density of a medium, from 0 on.
    Density,
    /// Signed distance from a surface, negative inside.
    Distance,
    /// None of these.
    Other,
}
