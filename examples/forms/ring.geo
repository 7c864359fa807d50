// A quarter of a ring between the radii 1 and 2, in quadrangles; gmsh -2 ring.geo makes ring.msh.
Point(1) = {0, 0, 0};
Point(2) = {1, 0, 0};
Point(3) = {2, 0, 0};
Point(4) = {0, 2, 0};
Point(5) = {0, 1, 0};
Line(1) = {2, 3};
Circle(2) = {3, 1, 4};
Line(3) = {4, 5};
Circle(4) = {5, 1, 2};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve {1, -3} = 4 Using Progression 1.2;
Transfinite Curve {2, 4} = 7;
Transfinite Surface {1};
Recombine Surface {1};

Physical Curve("bottom", 1) = {1};
Physical Curve("outside", 2) = {2};
Physical Curve("left", 3) = {3};
Physical Curve("inside", 4) = {4};
Physical Surface("ring", 10) = {1};
