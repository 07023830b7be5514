// Upsampling of a smaller march to the layer and the transmittance of the picture, or of one of the picture's size nothing but the latter.
//! include "scatter/march/upsampled_layer.wgsl"
//! include "scatter/march/unmarked.wgsl"
