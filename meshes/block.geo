// A block (0,1.5) x (0,1) x (0,0.8) with a round hole bored through it along y, finer at the hole
// and at the contact side. Remake block.msh with `python3 meshes/make.py` (gmsh from PyPI).
SetFactory("OpenCASCADE");

Box(1) = {0, 0, 0, 1.5, 1, 0.8};
Cylinder(2) = {0.8, 0, 0.45, 0, 1, 0, 0.2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };

e = 1e-3;
base() = Surface In BoundingBox{-e, -e, -e, 1.5 + e, 1 + e, e};
clamp() = Surface In BoundingBox{-e, -e, 0.8 - e, 1.5 + e, 1 + e, 0.8 + e};
hole() = Surface In BoundingBox{0.6 - e, -e, 0.25 - e, 1 + e, 1 + e, 0.65 + e};
left() = Surface In BoundingBox{-e, -e, -e, e, 1 + e, 0.8 + e};
right() = Surface In BoundingBox{1.5 - e, -e, -e, 1.5 + e, 1 + e, 0.8 + e};
front() = Surface In BoundingBox{-e, -e, -e, 1.5 + e, e, 0.8 + e};
back() = Surface In BoundingBox{-e, 1 - e, -e, 1.5 + e, 1 + e, 0.8 + e};

Physical Surface("base", 1) = {base()};
Physical Surface("clamp", 2) = {clamp()};
Physical Surface("edge", 3) = {left(), right(), front(), back()};
Physical Surface("hole", 4) = {hole()};
Physical Volume("block", 10) = {3};

MeshSize{ PointsOf{ Volume{3}; } } = 0.4;
MeshSize{ PointsOf{ Surface{base()}; } } = 0.28;
MeshSize{ PointsOf{ Surface{hole()}; } } = 0.2;
