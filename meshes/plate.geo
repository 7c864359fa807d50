// A plate (0,2) x (0,1) with a round hole and a notch in its right side, graded towards both
// and towards the contact side. Remake plate.msh with `python3 meshes/make.py` (gmsh from PyPI).
SetFactory("Built-in");

coarse = 0.13;
fine = 0.035;

Point(1) = {0, 0, 0, 0.06};
Point(2) = {2, 0, 0, 0.05};
Point(3) = {2, 0.4, 0, coarse};
Point(4) = {1.6, 0.5, 0, fine}; // re-entrant corner
Point(5) = {2, 0.6, 0, coarse};
Point(6) = {2, 1, 0, coarse};
Point(7) = {0, 1, 0, coarse};

Point(10) = {0.7, 0.55, 0, fine};
Point(11) = {0.9, 0.55, 0, fine};
Point(12) = {0.7, 0.75, 0, fine};
Point(13) = {0.5, 0.55, 0, fine};
Point(14) = {0.7, 0.35, 0, fine};

Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 1};
Circle(11) = {11, 10, 12};
Circle(12) = {12, 10, 13};
Circle(13) = {13, 10, 14};
Circle(14) = {14, 10, 11};

Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7};
Curve Loop(2) = {11, 12, 13, 14};
Plane Surface(1) = {1, 2};

Physical Curve("base", 1) = {1};
Physical Curve("clamp", 2) = {6};
Physical Curve("edge", 3) = {2, 3, 4, 5, 7};
Physical Curve("hole", 4) = {11, 12, 13, 14};
Physical Surface("plate", 10) = {1};
