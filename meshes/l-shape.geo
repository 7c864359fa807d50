// The L-shaped domain (-1,1)^2 without (0,1) x (-1,0) in right isosceles triangles, which bisection keeps. Remake
// l-shape.msh with `python3 meshes/make.py` (gmsh from PyPI).
Point(1) = {-1, -1, 0};
Point(2) = {0, -1, 0};
Point(3) = {-1, 0, 0};
Point(4) = {0, 0, 0};
Point(5) = {1, 0, 0};
Point(6) = {-1, 1, 0};
Point(7) = {0, 1, 0};
Point(8) = {1, 1, 0};
Line(1) = {1, 2};
Line(2) = {2, 4};
Line(3) = {4, 3};
Line(4) = {3, 1};
Line(5) = {4, 7};
Line(6) = {7, 6};
Line(7) = {6, 3};
Line(8) = {4, 5};
Line(9) = {5, 8};
Line(10) = {8, 7};
Curve Loop(1) = {1, 2, 3, 4};
Curve Loop(2) = {-3, 5, 6, 7};
Curve Loop(3) = {8, 9, 10, -5};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Plane Surface(3) = {3};
Transfinite Curve {1 : 10} = 5;
Transfinite Surface {1 : 3} Alternated;

Physical Curve("base", 1) = {1};
Physical Curve("corner", 2) = {2, 8};
Physical Curve("edge", 3) = {4, 6, 7, 9, 10};
Physical Surface("l-shape", 10) = {1, 2, 3};
